"""A published study's numbers, computed anew by a script that shares no code with the report."""

import json
import re
import subprocess
import sys
import tarfile
from itertools import product

import numpy as np
import pytest
from places import ROOT

RESULTS = ROOT / "docs" / "results"
PRESETS = ROOT / "policies" / "study" / "presets"
LINE = r"(.+): (\S+) \((\S+) to (\S+)\), 8 draws.*, p (\S+), after Holm (\S+)"
DESIGNS = {"factors": RESULTS / "teleop_modes_factors.toml", "answer": PRESETS / "answer.toml"}


@pytest.mark.parametrize("study", DESIGNS)
def test_declared_contrasts_come_out_as_published(study):
    archive, design = RESULTS / f"teleop_modes_{study}.tar.xz", DESIGNS[study]
    done = subprocess.run(
        [sys.executable, RESULTS / "recompute.py", archive, design],
        capture_output=True,
        text=True,
        check=True,
    )
    found = {name: [float(each) for each in numbers] for name, *numbers in re.findall(LINE, done.stdout)}
    published = json.loads((RESULTS / f"teleop_modes_{study}.json").read_text())["contrasts"]
    declared = {
        each.get("group") or each["name"].partition(":")[0]: each["estimate"] | each
        if study == "factors"
        else each
        for each in published
        if "declared" in (each.get("family"), each.get("kind"))
    }
    assert len(declared) == 3
    assert found.keys() == declared.keys()
    for name, each in declared.items():
        shares = [100 * share for share in (each.get("value", each["estimate"]), *each["interval"])]
        assert found[name] == pytest.approx([*shares, each["p"], each["p_adjusted"]], abs=1e-3)


def test_an_archive_that_lacks_a_draw_is_not_tested(tmp_path):
    design = tmp_path / "more.toml"
    factors = (RESULTS / "teleop_modes_factors.toml").read_text()
    design.write_text(factors.replace("draws = 8", "draws = 9"))
    script = [sys.executable, RESULTS / "recompute.py", RESULTS / "teleop_modes_factors.tar.xz", design]
    done = subprocess.run(script, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "expected 9 draws of each policy" in done.stderr
    assert not done.stdout


@pytest.mark.parametrize("amounts", [1, 3])
def test_the_metric_that_goes_with_success_is_named_first(tmp_path, amounts):
    """What several amounts of the same recordings say is said once: p is as of one of them."""
    rng, draws = np.random.default_rng(0), range(3)
    shares = {(mode, draw): rng.random() for mode in "abcd" for draw in draws}
    jobs = {
        f"collect/reach/{mode}/{draw}": {
            "result": {"quality": {"telling": -share, "other": rng.random(), "saturation": share}}
        }
        for (mode, draw), share in shares.items()
    }
    conditions = [
        {
            "task": "reach",
            "label": f"{mode} {amount} min" if amount else mode,
            "treatment": "",
            "draws": {str(draw): shares[mode, draw] for draw in draws},
        }
        for mode in "abcd"
        for amount in range(amounts)
    ]
    study = {"design": {"draws": 3}, "jobs": jobs, "conditions": conditions}
    (tmp_path / "study.json").write_text(json.dumps(study))
    done = subprocess.run(
        [sys.executable, RESULTS / "metrics.py", tmp_path / "study.json"],
        capture_output=True,
        text=True,
        check=True,
    )
    count, first, other = done.stdout.splitlines()
    assert count == f"{amounts} groups, {12 * amounts} policies"
    assert first.startswith("telling: -1.00 (-1.00 to -1.00), p ")
    assert float(first.split()[-1]) == pytest.approx(1 / 24, abs=0.02)  # of all orders of four modes
    assert other.startswith("other: ")


def share_after(mode, minutes):
    return 1 / (1 + (6.0 * {"quick": 1.0, "slow": 2.0}[mode] / minutes) ** 2)


@pytest.fixture
def archive(tmp_path):
    """An archive of a study in which a mode needs twice the minutes."""
    rng = np.random.default_rng(0)
    for mode, draw, minutes in product(("quick", "slow"), range(4), (3, 5, 10, 20)):
        rollouts = [{"success": bool(rng.random() < share_after(mode, minutes))} for _ in range(200)]
        learnt = {"operator_time": 60.0 * minutes, "episodes": minutes * (12.0 if mode == "quick" else 6.0)}
        file = tmp_path / f"evaluations/reach/{mode}/{draw}/nominal/realised-time-{minutes}.json"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps({"arms": {mode: [{"trained_on": learnt, "rollouts": rollouts}]}}))
    path = tmp_path / "study.tar.xz"
    with tarfile.open(path, "w:xz") as file:
        file.add(tmp_path / "evaluations", "evaluations")
    return path


def said_by(*script):
    return subprocess.run([sys.executable, *script], capture_output=True, text=True, check=True).stdout


def test_a_mode_that_needs_twice_the_minutes_is_said_to(archive):
    told = said_by(RESULTS / "minutes.py", archive, "quick", "slow")
    said = re.findall(r"reach, (\w+): slow / quick (\S+) \((\S+) to (\S+)\), 4 draws", told)
    ratios = {name: [float(each) for each in numbers] for name, *numbers in said}
    for name, true in (("minutes", 2.0), ("demonstrations", 1.0)):
        ratio, low, high = ratios[name]
        assert low < true < high
        assert ratio == pytest.approx(true, rel=0.15)


def test_success_over_minutes_is_drawn_and_said(archive, tmp_path):
    told = said_by(RESULTS / "success.py", tmp_path / "figure.png", archive)
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")
    points = re.findall(r"reach, (\w+): (\S+) min (\S+) % \((\S+) to (\S+)\), 4 draws", told)
    assert len(points) == 8
    for mode, minutes, share, low, high in points:
        assert float(low) < float(share) < float(high)
        assert float(share) == pytest.approx(100 * share_after(mode, float(minutes)), abs=6.0)


def test_a_contact_after_the_hand_got_nearer_no_more_is_told_apart(tmp_path):
    on, lost = {"contacts": 2, "success": False}, [1.0, 0.9] + [0.5] * 8
    rollouts = [
        {"contacts": 0, "success": True, "distances": [1.0, 0.5]},
        on | {"first_contact": 2.5, "distances": lost},  # too early to say
        on | {"first_contact": 6.0, "distances": lost},  # it had fallen within 5 s
        on | {"first_contact": 7.95, "distances": lost},
        on | {"first_contact": 9.0, "distances": [*lost[:5], 0.8, 0.8, 0.8, 0.8, 0.8]},  # it goes elsewhere
        on | {"first_contact": 9.0, "distances": lost, "success": True},
    ]
    file = tmp_path / "evaluations/reach/ee/0/nominal/realised-time.json"
    file.parent.mkdir(parents=True)
    file.write_text(json.dumps({"arms": {"ee": [{"rollouts": rollouts}]}}))
    with tarfile.open(tmp_path / "study.tar.xz", "w:xz") as archive:
        archive.add(tmp_path / "evaluations", "evaluations")
    assert said_by(RESULTS / "contacts.py", tmp_path / "study.tar.xz") == (
        "reach, ee: of 6 rollouts 5 touched something, 3 on the way, 2 after they were lost; 1 succeeded\n"
    )


@pytest.mark.parametrize(
    ("script", "told"),
    [
        (("contacts.py", RESULTS / "teleop_modes_factors.tar.xz"), "expected rollouts that say `distances`"),
        (("success.py", *[RESULTS / "teleop_modes_factors.tar.xz"] * 2), "expected FIGURE.png"),
        (
            ("minutes.py", RESULTS / "teleop_modes_answer.tar.xz", "ee", "direct"),
            "pick_place, ee: expected policies of several amounts of data, got one",
        ),
    ],
)
def test_settings_that_a_script_cannot_use_are_one_line(script, told):
    name, *files = script
    done = subprocess.run(
        [sys.executable, RESULTS / name, *files], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert done.stderr.startswith(told)
    assert len(done.stderr.splitlines()) == 1
