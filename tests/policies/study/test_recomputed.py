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
TASKS = ("reach", "pick_place")
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


def test_a_group_without_differences_leaves_the_others_what_they_say(tmp_path):
    """There ρ is not defined; a metric that never varies is left out."""
    every, success = (
        list(product(("reach", "pick_place"), "abcd", range(3))),
        {"a": 0, "b": 1, "c": 2, "d": 3},
    )
    jobs = {
        f"collect/{task}/{mode}/{draw}": {"result": {"quality": {"telling": -success[mode], "constant": 1.0}}}
        for task, mode, draw in every
    }
    conditions = [
        {
            "task": task,
            "label": mode,
            "treatment": "",
            "draws": {str(draw): 1.0 if task == "reach" else success[mode] / 4 for draw in range(3)},
        }
        for task, mode in product(("reach", "pick_place"), "abcd")
    ]
    study = {"design": {"draws": 3}, "jobs": jobs, "conditions": conditions}
    (tmp_path / "study.json").write_text(json.dumps(study))
    count, line = said_by(RESULTS / "metrics.py", tmp_path / "study.json").splitlines()
    assert count == "2 groups, 24 policies"
    assert line.startswith("telling: -1.00 (-1.00 to -1.00), p over all metrics ")
    assert line.endswith(" (1 of 2 groups)")


def share_after(mode, minutes):
    return 1 / (1 + (6.0 * {"quick": 1.0, "slow": 2.0}[mode] / minutes) ** 2)


def packed(folder, cells, rollouts=200):
    """Write an archive of a study: of (task, mode, draw, minutes), how many of the rollouts succeed."""
    for (task, mode, draw, minutes), successes in cells.items():
        rows = [{"success": k < successes} for k in range(rollouts)]
        learnt = {"operator_time": 60.0 * minutes, "episodes": minutes * (12.0 if mode == "quick" else 6.0)}
        file = folder / f"evaluations/{task}/{mode}/{draw}/nominal/realised-time-{minutes}.json"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps({"arms": {mode: [{"trained_on": learnt, "rollouts": rows}]}}))
    path = folder / "study.tar.xz"
    with tarfile.open(path, "w:xz") as file:
        file.add(folder / "evaluations", "evaluations")
    return path


@pytest.fixture
def cells():
    """Successes of a study in which a mode needs twice the minutes."""
    rng = np.random.default_rng(0)
    every = product(("quick", "slow"), range(4), (3, 5, 10, 20))
    return {("reach", *each): int(rng.binomial(200, share_after(each[0], each[2]))) for each in every}


@pytest.fixture
def archive(tmp_path, cells):
    return packed(tmp_path, cells)


def said_by(*script):
    words = [sys.executable, "-W", "error", *script]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout


def test_a_mode_that_needs_twice_the_minutes_is_said_to(archive):
    told = said_by(RESULTS / "minutes.py", archive, "quick", "slow")
    said = re.findall(r"reach, (\w+): slow / quick (\S+) \((\S+) to (\S+)\), 4 draws", told)
    ratios = {name: [float(each) for each in numbers] for name, *numbers in said}
    for name, true in (("minutes", 2.0), ("demonstrations", 1.0)):
        ratio, low, high = ratios[name]
        assert low < true < high
        assert ratio == pytest.approx(true, rel=0.15)
    assert told.count("; highest success quick 92 %, slow 72 %") == 2
    assert "parallel" not in told
    assert "beyond" not in told


def test_the_page_says_the_minutes_of_the_archive():
    modes = ("ee_mink", "ee_dls", "direct")
    told = said_by(RESULTS / "minutes.py", RESULTS / "teleop_modes_amount.tar.xz", "ee", *modes)
    page = (RESULTS / "teleop_modes.md").read_text()
    for mode in modes:
        found = {task: re.search(rf"{task}, minutes: {mode} / ee (.+?\))", told)[1] for task in TASKS}
        (row,) = re.findall(rf"^\| `{mode}` \| .*", page, re.MULTILINE)
        assert row.endswith(f" | {found['reach']} | {found['pick_place']} |")


@pytest.mark.parametrize(
    ("quick", "slow", "said"),
    [
        ((50, 50, 50), (50, 50, 50), ": success does not clearly rise with it, no ratio"),
        ((45, 45, 45), (25, 25, 25), ": success does not clearly rise with it, no ratio"),
        ((45, 40, 35), (40, 35, 30), ": success does not clearly rise with it, no ratio"),
        ((20, 35, 49), (5, 15, 25), "lines are not parallel, 4 draws; highest success quick 98 %, slow 50 %"),
        ((30, 35, 40), (15, 20, 25), ", beyond the amounts driven, 4 draws"),
    ],
)
def test_a_mode_that_does_not_come_to_the_others_success_is_said_to(tmp_path, quick, slow, said):
    shares = {
        "quick": dict(zip((3, 5, 10), quick, strict=True)),
        "slow": dict(zip((3, 5, 10), slow, strict=True)),
    }
    every = product(shares, range(4), (3, 5, 10))
    path = packed(tmp_path, {("reach", *each): shares[each[0]][each[2]] for each in every}, 50)
    told = said_by(RESULTS / "minutes.py", path, "quick", "slow").splitlines()
    assert len(told) == 2
    assert all(said in line for line in told)


def test_a_draw_that_lacks_an_amount_is_left_out(tmp_path, cells):
    whole = {cell: count for cell, count in cells.items() if cell[2] != 1}
    (tmp_path / "whole").mkdir()
    expected = said_by(RESULTS / "minutes.py", packed(tmp_path / "whole", whole), "quick", "slow")
    del cells["reach", "slow", 1, 3]
    told = said_by(RESULTS / "minutes.py", packed(tmp_path, cells), "quick", "slow")
    assert told == expected.replace("3 draws", "3 draws (1 not whole)")


def test_a_task_of_one_amount_leaves_the_others_their_lines(tmp_path, cells):
    (tmp_path / "reach").mkdir()
    expected = said_by(RESULTS / "minutes.py", packed(tmp_path / "reach", cells), "quick", "slow")
    cells |= {("pick_place", mode, draw, 60): 100 for mode in ("quick", "slow") for draw in range(4)}
    told = said_by(RESULTS / "minutes.py", packed(tmp_path, cells), "quick", "slow")
    assert told == f"{expected}pick_place, quick: expected policies of several amounts of data, got one\n"


def test_success_over_minutes_is_drawn_and_said(archive, tmp_path):
    told = said_by(RESULTS / "success.py", tmp_path / "figure.png", archive)
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")
    points = re.findall(r"reach, (\w+): (\S+) min (\S+) % \((\S+) to (\S+)\), 4 draws", told)
    assert len(points) == 8
    for mode, minutes, share, low, high in points:
        assert float(low) < float(share) < float(high)
        assert float(share) == pytest.approx(100 * share_after(mode, float(minutes)), abs=6.0)


def test_one_draw_has_no_interval(tmp_path, cells):
    path = packed(tmp_path, {cell: count for cell, count in cells.items() if cell[2] == 0})
    told = said_by(RESULTS / "success.py", tmp_path / "figure.png", path)
    assert "reach, quick: 20.0 min 90.5 % (one draw)" in told
    assert "nan" not in told


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
        (
            ("minutes.py", RESULTS / "teleop_modes_answer.tar.xz", "ee", "typo"),
            "pick_place: expected two whole draws or more of ee and typo, got 0",
        ),
        (("metrics.py", RESULTS / "takeover_takeover.json"), "expected three modes with all draws"),
        (("success.py", "figure.png", RESULTS / "takeover_takeover.tar.xz"), "expected undisturbed policies"),
        (
            ("minutes.py", RESULTS / "takeover_takeover.tar.xz", "ee", "direct"),
            "expected undisturbed policies",
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
