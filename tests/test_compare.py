"""`handrail-compare` works on anybody's datasets, says what does not apply, and never claims too much."""

import csv
import json
import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from datasets_helpers import REPO, create, frame_of

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.collection import collected, matched_number, matched_time, shared_seeds
from handrail.datasets.comparison.compare import compare
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.comparison.evaluations import FORMAT
from handrail.datasets.comparison.findings import findings, headline
from handrail.datasets.comparison.groups import load_groups
from handrail.datasets.comparison.productivity import rate_ratio
from handrail.datasets.comparison.report import as_json, write_report
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.load import read_demonstrations
from handrail.datasets.quality.measure import measure
from handrail.datasets.schema import Feature
from handrail.scripts import cli
from handrail.scripts.compare import _compare

JOINTS = [f"{name}.pos" for name in ("pan", "lift", "elbow", "flex", "roll", "gripper")]
CAMERA = "observation.images.top"
EPISODES, FRAMES = 6, 24


def lerobot_dataset(root: Path, names: list[str], fps: int, jitter: float, camera: bool) -> Path:
    """Record with plain LeRobot an arm that follows commanded positions one frame later."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from lerobot.datasets.lerobot_dataset import LeRobotDataset

        vector = {"dtype": "float32", "shape": (len(names),), "names": names}
        features = {"observation.state": vector, "action": vector}
        if camera:
            axes = ["height", "width", "channels"]
            features[CAMERA] = {"dtype": "video", "shape": (32, 48, 3), "names": axes}
        dataset = LeRobotDataset.create(REPO, fps, features, root=root, robot_type="so101")
        rng = np.random.default_rng(len(names))
        for episode in range(EPISODES):
            state = np.zeros(len(names), np.float32)
            for index in range(FRAMES + 3 * episode):
                goal = np.sin(0.1 * index + np.arange(len(names))) + jitter * rng.normal(size=len(names))
                action = goal.astype(np.float32)
                picture = np.full((32, 48, 3), 40 * episode, np.uint8)
                frame = {"observation.state": state, "action": action, "task": "wave"}
                dataset.add_frame(frame | ({CAMERA: picture} if camera else {}))
                state = action
            dataset.save_episode()
        dataset.finalize()
    return root


@pytest.fixture(scope="module")
def foreign(tmp_path_factory):
    """Two datasets of another robot, not made by Handrail."""
    folder = tmp_path_factory.mktemp("foreign")
    return [
        str(lerobot_dataset(folder / name, JOINTS, 30, jitter, name == "calm"))
        for name, jitter in (("calm", 0.01), ("shaky", 0.3))
    ]


def handrail_dataset(root: Path, fail_every: int, mode: str, episodes: int = 12, slow: int = 0) -> str:
    """Record with Handrail's writer: seeds are the same in every dataset, lengths are not."""
    names = ("tool.x", "tool.y", "tool.z")
    features = {
        "observation.state": Feature("float32", (3,), names),
        "action": Feature("float32", (2,), ("v_x", "gripper")),
        "teleop.values": Feature("float32", (2,), ("ee.vx", "gripper")),
        "teleop.mode": Feature("string"),
        "controller.smallest_distance": Feature("float32"),
        "safety.contacts": Feature("int64"),
    }
    rng = np.random.default_rng(len(mode))
    with create(root, features=features) as writer:
        for episode in range(episodes):
            count = 30 + episode + slow
            for index in range(count):
                place = np.array([index / count, 0.1 * np.sin(index / 5), 0.0]) + 0.001 * rng.normal(size=3)
                writer.add_frame(
                    {
                        "observation.state": place,
                        "action": np.array([1.0 + 0.1 * rng.normal(), 0.0]),
                        "teleop.values": np.array([rng.normal(), 0.0]),
                        "teleop.mode": mode,
                        "controller.smallest_distance": 0.2 - 0.15 * index / count,
                        "safety.contacts": int(index == 5 and episode == 1),
                    },
                    "go",
                )
            success = (episode + 1) % fail_every != 0
            reason = None if success else "timeout"
            writer.save_episode({"success": success, "failure_reason": reason, "seed": episode, "mode": mode})
    return str(root)


@pytest.fixture(scope="module")
def ours(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ours")
    return [
        handrail_dataset(folder / "quick", 100, "ee"),
        handrail_dataset(folder / "slow", 2, "joints", slow=60),
    ]


def report(arguments, folder, **options):
    comparison = compare(CompareConfig(tuple(arguments), str(folder), **options))
    files = write_report(comparison)
    return comparison, json.loads((folder / "report.json").read_text(), parse_constant=_no_constant), files


def _no_constant(name):
    raise AssertionError(f"{name} is no JSON")


def test_two_datasets_that_handrail_did_not_make(foreign, tmp_path):
    _, content, files = report(foreign, tmp_path)
    assert [file.name for file in files] == ["report.html", "report.json", "episodes.csv", "differences.csv"]
    metrics = content["views"]["all episodes"]["metrics"]
    applies = {name for name, groups in metrics.items() if groups["calm"]["mean"] is not None}
    never = {"contacts", "impulse", "smallest_distance", "time_within_margin", "slack_used", "input_effort"}
    never |= {"input_reversals", "active_axes", "mode_switches"}
    assert applies == {metric.name for metric in METRICS} - never
    page = (tmp_path / "report.html").read_text()
    for name in never:
        assert metrics[name]["shaky"]["reason"].startswith("no column")
        (metric,) = [metric for metric in METRICS if metric.name == name]
        assert re.search(rf"{metric.title}</td><td>calm, shaky</td><td>no column", page)
    assert metrics["tracking_error"]["calm"]["mean"] == pytest.approx(0.0, abs=1e-6)
    found = {d["metric"]: d for d in content["views"]["all episodes"]["differences"]}
    assert found["ldlj"]["estimate"] < 0 < found["action_variance"]["estimate"]
    assert "calm" in page
    assert "wave" in page
    pictures = re.findall(r"data:image/jpeg;base64,([^\"]+)", page)
    assert len(set(pictures)) == len(pictures) == 3  # the first of each of the first three episodes


def test_the_page_needs_nothing_else(foreign, tmp_path):
    report(foreign, tmp_path)
    page = (tmp_path / "report.html").read_text()
    addresses = re.findall(r'(?:src|href)="([^"]{0,30})', page)
    assert addresses
    assert all(address.startswith("data:image/") for address in addresses)
    assert "<script" not in page
    assert page.index("headline") < page.index('class="card"') < page.index('class="figure"')


def test_the_same_seed_gives_the_same_report(ours, tmp_path):
    for name in ("one", "two"):
        report(ours, tmp_path / name)
    for name in ("episodes.csv", "differences.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    one, two = ((tmp_path / name / "report.html").read_text() for name in ("one", "two"))
    assert one == two


def test_what_does_not_apply_is_empty_and_never_zero(foreign, ours, tmp_path):
    report([foreign[0], ours[0]], tmp_path)
    rows = list(csv.DictReader((tmp_path / "episodes.csv").read_text().splitlines()))
    assert {row["contacts"] for row in rows if row["group"] == "calm"} == {""}
    assert [row["contacts"] for row in rows if row["group"] == "quick"][:3] == ["0.0", "1.0", "0.0"]
    assert not any("nan" in value for row in rows for value in row.values())


def test_different_columns_are_not_put_on_one_scale(foreign, ours, tmp_path):
    _, content, _ = report([foreign[0], ours[0]], tmp_path)
    reasons = {
        d["metric"]: d.get("does_not_apply", "") for d in content["views"]["all episodes"]["differences"]
    }
    assert "no common scale" in reasons["state_coverage"]
    assert reasons["sparc"] == ""
    assert any("different columns" in finding["text"] for finding in content["findings"])


def test_modes_of_one_dataset(tmp_path):
    root = tmp_path / "both"
    handrail_dataset(root, 100, "ee", 6)
    groups = load_groups([str(root), handrail_dataset(tmp_path / "other", 100, "joints", 6)], "mode")
    assert [group.label for group in groups] == ["both · ee", "other · joints"]
    with pytest.raises(HandrailError, match="expected 2 to 8 groups of episodes, got ee"):
        load_groups([str(root)], "mode")
    with pytest.raises(HandrailError, match=r"unknown column 'colour' of episodes, expected one of .*mode"):
        load_groups([str(root)], "colour")


def test_a_mode_that_only_the_frames_know(tmp_path):
    features = {"action": Feature("float32", (2,)), "teleop.mode": Feature("string")}
    with create(tmp_path / "set", features=features) as writer:
        for mode in ("ee", "base", "ee"):
            for index in range(5):
                frame = {"action": frame_of(0, index, False)["action"], "teleop.mode": mode}
                writer.add_frame(frame, "go")
            writer.save_episode()
    groups = load_groups([tmp_path / "set"], "mode")
    assert {group.label: len(group.episodes) for group in groups} == {"ee": 2, "base": 1}


def test_matched_views(ours):
    quick, slow = load_groups(ours)
    short = replace(quick, episodes=quick.episodes[:5])
    assert [len(group.episodes) for group in matched_number([short, slow])] == [5, 5]
    matched = matched_time([quick, slow])
    budget = collected(quick).operator_time
    assert [collected(group).operator_time <= budget + 1e-9 for group in matched] == [True, True]
    assert matched[0] == quick
    assert budget - collected(matched[1]).operator_time < slow.episodes[len(matched[1].episodes)].seconds


def test_collected(ours):
    quick, slow = map(collected, load_groups(ours))
    assert (quick.episodes, quick.successes, quick.failure_share) == (12, 12, 0.0)
    assert (slow.successes, dict(slow.reasons)) == (6, {"timeout": 6})
    assert quick.operator_time == pytest.approx(sum(range(30, 42)) / 30)
    assert slow.successes_an_hour == pytest.approx(3600 * 6 / (sum(range(90, 102)) / 30))


def test_episodes_that_began_alike_are_paired(ours):
    quick, slow = load_groups(ours)
    assert shared_seeds(quick, slow) == [(place, place) for place in range(12)]
    again = replace(slow, episodes=(*slow.episodes, slow.episodes[0]))
    assert shared_seeds(quick, again) == []


def test_successes_an_hour(ours):
    quick, slow = load_groups(ours)
    ratio = rate_ratio(quick, slow, np.random.default_rng(0))
    rates = [collected(group).successes_an_hour or 0.0 for group in (quick, slow)]
    assert ratio.estimate == pytest.approx(rates[0] / rates[1])
    assert 1.0 < ratio.interval[0] < ratio.estimate < ratio.interval[1]
    assert ratio.p < 0.01
    same = rate_ratio(quick, quick, np.random.default_rng(0))
    assert (same.estimate, same.interval, same.p) == (1.0, (1.0, 1.0), 1.0)
    few = replace(slow, episodes=slow.episodes[:5]), replace(quick, episodes=quick.episodes[7:])
    assert rate_ratio(*few, np.random.default_rng(0)).p > 0.005  # 2 of 252 permutations


def test_findings_claim_no_more_than_the_intervals(ours, tmp_path):
    comparison = compare(CompareConfig(tuple(ours)))
    found = findings(comparison)
    assert any(finding.kind == "caution" and "No evaluations" in finding.text for finding in found)
    silent = [finding.text for finding in found if not finding.detected and finding.kind != "caution"]
    assert silent
    assert all(
        "not evidence of equality" in text or "go unseen" in text or "no difference" in text
        for text in silent
    )
    assert not any(re.search(r"\bequal(ly)?\b(?! length)", finding.text) for finding in found)
    same = compare(CompareConfig((ours[0], ours[0]), labels=("one", "other")))
    assert not any(finding.detected for finding in findings(same))
    assert "no difference in success detected" in headline(findings(same))


def evaluations(path: Path, **shares) -> Path:
    rng = np.random.default_rng(0)
    content = {
        label: [
            {
                "training_seed": seed,
                "trained_on": {"episodes": 12, "operator_time": 30.0},
                "rollouts": [{"seed": k, "success": bool(rng.random() < share)} for k in range(80)],
            }
            for seed in range(3)
        ]
        for label, share in shares.items()
    }
    path.write_text(json.dumps({"format": FORMAT, "arms": content}))
    return path


def test_policies_come_first(ours, tmp_path):
    given = evaluations(tmp_path / "evaluations.json", quick=0.9, slow=0.5)
    comparison, content, _ = report(ours, tmp_path / "out", evaluations=(str(given),))
    found = findings(comparison)
    assert found[0].kind == "outcome"
    assert "Policies trained on quick succeeded more often" in headline(found)
    assert content["outcomes"]["differences"][0]["nested"][1] < 0
    assert any("training seeds" in text["text"] for text in content["findings"])
    assert as_json(comparison, found)["outcomes"]["arms"][0]["label"] == "quick"
    wrong = evaluations(tmp_path / "wrong.json", telepathy=0.9)
    with pytest.raises(HandrailError, match="unknown arm 'telepathy', expected one of quick, slow"):
        compare(CompareConfig(tuple(ours), evaluations=(str(wrong),)))


def test_success_only(ours, tmp_path):
    comparison = compare(CompareConfig(tuple(ours), success_only=True))
    view = comparison.everything
    assert [len(group.episodes) for group in view.groups] == [12, 6]
    assert [each.episodes for each in view.collected] == [12, 12]


def test_columns_may_be_named(foreign):
    episodes = read_demonstrations(foreign[0], replace(CompareConfig(()).columns, asked="action"))
    found = measure({"calm": episodes}, np.random.default_rng(0)).values
    assert found["input_effort"]["calm"].applies
    assert not found["contacts"]["calm"].applies


def test_one_episode_is_enough_to_say_that_it_is_too_few(tmp_path):
    roots = [handrail_dataset(tmp_path / name, 100, name, 1) for name in ("a", "b")]
    comparison, content, _ = report(roots, tmp_path / "out")
    reasons = [d["does_not_apply"] for d in content["views"]["all episodes"]["differences"]]
    assert "fewer than 5 episodes of a group have a value" in reasons
    assert (
        content["views"]["all episodes"]["metrics"]["action_variance"]["a"]["reason"]
        == "there is only one episode"
    )
    assert not any(finding.detected for finding in findings(comparison))


WRONG = {
    "nothing": ([], "DATASETS|expected one folder"),
    "one": (
        ["{quick}"],
        "expected 2 to 8 groups of episodes, got quick; name another dataset, or say --by mode",
    ),
    "no such": (["{quick}", "nowhere"], "nowhere.*expected a folder, found none"),
    "column": (["{quick}", "{slow}", "--by", "colour"], "unknown column 'colour'"),
    "labels": (["{quick}", "{slow}", "--labels", "a"], "--labels: expected 2 names, got 1"),
    "same name": (["{quick}", "{quick}"], "two datasets are called 'ours0/quick'"),
    "baseline": (
        ["{quick}", "{slow}", "--baseline", "z"],
        "unknown baseline 'z': expected one of quick, slow",
    ),
    "margin": (["{quick}", "{slow}", "--margin", "-1"], "--margin -1.0: expected a positive distance"),
    "output": (
        ["{quick}", "{slow}", "--output", "{quick}/meta/info.json"],
        "expected a folder, found a file",
    ),
    "evaluations": (["{quick}", "{slow}", "--evaluations", "no.json"], "expected a JSON file, found none"),
    "flag": (["{quick}", "{slow}", "--speed", "9"], "--speed"),
}


@pytest.mark.parametrize(("arguments", "message"), WRONG.values(), ids=WRONG)
def test_wrong_input_is_one_line_and_code_2(arguments, message, ours, capsys):
    words = [word.format(quick=ours[0], slow=ours[1]) for word in arguments]
    with pytest.raises(SystemExit) as stop:
        cli.run(lambda: _compare(cli.parse(CompareConfig, "handrail-compare", words)))
    assert stop.value.code == cli.BAD_INPUT
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert re.search(message, line), line


def test_the_command_says_what_it_found(ours, tmp_path, capsys):
    words = [*ours, "--output", str(tmp_path / "out"), "--no_pictures"]
    assert _compare(cli.parse(CompareConfig, "handrail-compare", words)) == 0
    said = capsys.readouterr().out
    assert "Successes per operator hour" in said
    assert str(tmp_path / "out" / "report.html") in said
