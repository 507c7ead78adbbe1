"""People, compared: participants are paired and resampled; what is missing or made up is said."""

import csv
import itertools
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_helpers import ran, refused
from datasets_helpers import create

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison import people as comparing
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.comparison.people import FORMS, compare_people, paired_by_scene, people_report
from handrail.datasets.comparison.scores import DEMO, SCORES, read_scores
from handrail.datasets.comparison.user_study import Trial, read_study
from handrail.datasets.format.schema import Feature
from handrail.datasets.statistics.contrast import LEVEL, holm
from handrail.datasets.statistics.resampling import bootstrap_mean

FPS = 30
NAMES = ("tool.x", "tool.y", "tool.z")
FEATURES = {
    "observation.state": Feature("float32", (3,), NAMES),
    "action": Feature("float32", (2,), ("v_x", "gripper")),
    "teleop.raw": Feature("float32", (2,), ("ee.vx", "ee.vy")),
    "teleop.mask": Feature("bool", (3,)),
    "teleop.mode": Feature("string"),
    "teleop.device": Feature("string"),
    "teleop.age": Feature("float32"),
    "teleop.round_trip": Feature("float32"),
    "teleop.undos": Feature("int64"),
    "controller.smallest_distance": Feature("float32"),
    "safety.contacts": Feature("int64"),
}


def frame(mode, index, device, undos=0):
    """Return a frame of a person who pushes to and fro, or of a script."""
    return {
        "observation.state": np.array([0.01 * index, 0.0, 0.0]),
        "action": np.array([0.3, 0.0]),
        "teleop.raw": np.array([np.sign(np.sin(0.5 * index)) * (1.0 if device else 30.0), 0.0]),
        "teleop.mask": np.array([True, False, True]),
        "teleop.mode": mode,
        "teleop.device": device,
        "teleop.age": 0.01 * (index % 5) if device else 0.0,
        "teleop.round_trip": 0.02 if device else 0.0,
        "teleop.undos": undos,
        "controller.smallest_distance": 0.2,
        "safety.contacts": 0,
    }


def dataset(root, task, mode, episodes, operator="browser"):
    """Record episodes of (participant, scene, frames, success)."""
    device = "keyboard" if operator == "browser" else ""
    with create(root, features=FEATURES) as writer:
        for participant, scene, frames, success in episodes:
            for index in range(frames):
                writer.add_frame(frame(mode, index, device, undos=int(index > 5) if device else 0), "go")
            meta = {"success": success, "seed": scene, "operator": operator, "mode": mode}
            writer.save_episode(meta | {"environment": task, "participant": participant})
    return Path(root)


def study(root, data, scores=(), demo=False):
    """Make a study's folder: `data` has episodes by (task, mode), `scores` rows of scores.csv."""
    root.mkdir(parents=True)
    (root / "study.json").write_text(json.dumps({"demo": demo, "study": {}}))
    for (task, mode), episodes in data.items():
        dataset(root / "data" / task / mode, task, mode, episodes)
    if scores:
        write_scores(root, ["participant,condition,score,value", *scores])
    return root


def write_scores(root, lines):
    """Write scores.csv, line by line."""
    (root / "exports").mkdir(exist_ok=True)
    (root / "exports" / "scores.csv").write_text("\n".join(lines) + "\n")


def people(count, frames, success=True, scene=7):
    """Return one episode each of participants P1, P2, …; `frames` says how long, by number from 0."""
    return [(f"P{place + 1}", scene, frames(place), success) for place in range(count)]


SLOWER = (12, 3, 9, 15, 6, 21)  # frames by which each participant is slower with `direct`


def of(found, scope, measure):
    """Return the values or contrasts of a measure by label."""
    return {each.label: each for each in found if (each.scope, each.measure.name) == (scope, measure)}


def rng():
    return np.random.default_rng(0)


@pytest.fixture(scope="module")
def six(tmp_path_factory):
    """Six participants, two modes, one task; the forms of five."""
    data = {
        ("reach", "direct"): people(6, lambda place: 40 + 5 * place + SLOWER[place]),
        ("reach", "ee"): people(6, lambda place: 40 + 5 * place),
    }
    scores = [
        f"P{n},{mode},sus,{value}" for n in range(1, 6) for mode, value in (("ee", 80 + n), ("direct", 50))
    ]
    root = study(tmp_path_factory.mktemp("study") / "six", data, scores)
    return root, compare_people(CompareConfig(study=str(root), baseline="ee"))


def test_a_difference_is_taken_within_participants(six):
    times = of(six[1].contrasts, "reach", "completion_time")["direct"]
    assert times.counts == (6,)
    assert times.estimate == pytest.approx(np.mean(SLOWER) / FPS)
    low, high = times.interval
    assert min(SLOWER) / FPS < low < times.estimate < high < max(SLOWER) / FPS


def test_p_is_that_of_all_swaps_of_signs(six):
    each = np.array(SLOWER) / FPS
    swapped = [np.mean(each * signs) for signs in itertools.product((-1, 1), repeat=6)]
    exact = np.mean(np.abs(swapped) >= each.mean() - 1e-12)
    times = of(six[1].contrasts, "reach", "completion_time")["direct"]
    assert times.p == pytest.approx(exact)
    tested = [each for each in six[1].contrasts if each.scope == "reach" and each.p is not None]
    assert [each.p_adjusted for each in tested] == pytest.approx(holm([each.p for each in tested]))


def test_too_few_participants_are_said(six, tmp_path):
    without_scores = shutil.copytree(six[0], tmp_path / "six")
    shutil.rmtree(without_scores / "exports")
    for found in six[1], compare_people(CompareConfig(study=str(without_scores), baseline="ee")):
        assert any("Too few to detect any difference" in text for text in people_report(found).cautions)
    assert not any(each.detected for each in six[1].contrasts if each.scope == "reach")
    nine = {f"P{n}": {None: [float(n)]} for n in range(9)}
    more = {name: {None: [50.0 + value[None][0] ** 2]} for name, value in nine.items()}
    alone = paired_by_scene(more, nine, rng())
    assert alone.p == pytest.approx(2.0**-8)
    assert alone.p < LEVEL
    assert alone.interval[0] > 0
    same = paired_by_scene(nine, nine, rng())
    assert (same.estimate, same.interval, same.p) == (0.0, (0.0, 0.0), None)


def test_nothing_is_said_of_tables_that_are_empty(tmp_path):
    few, missing = "Too few to detect any difference", "No scores yet"
    data = {("reach", mode): people(8, lambda place: 40 + place) for mode in ("direct", "ee")}
    comparison = compare_people(CompareConfig(study=str(study(tmp_path / "eight", data))))
    told = people_report(comparison).cautions
    assert any(missing in text for text in told)
    assert not any(few in text for text in told)
    assert any("Below 20, intervals are rough" in text for text in told)


def test_participants_are_what_is_resampled():
    many = {f"P{n}": {scene: [float(n)] for scene in range(20)} for n in range(5)}
    trials = [
        Trial("go", "ee", name, {"sus": value}, scene)
        for name, scenes in many.items()
        for scene, (value,) in scenes.items()
    ]
    (means,), _ = comparing.compared("go", SCORES[2:], trials, ["ee"], "ee", list(many), rng())
    assert means.interval == pytest.approx(bootstrap_mean(np.arange(5.0), rng()))


def test_scenes_that_only_one_condition_has_do_not_count(six):
    one = {"P1": {1: [5.0], 2: [100.0]}}
    other = {"P1": {1: [3.0], 3: [0.0]}}
    assert paired_by_scene(one, other, rng()).estimate == 2.0
    apart = {"P1": {4: [1.0], 5: [3.0]}}
    assert paired_by_scene(one, apart, rng()).estimate == pytest.approx(52.5 - 2.0)


def test_two_participants_have_no_interval_and_a_sentence(tmp_path):
    data = {("reach", mode): people(2, lambda place: 40 + place) for mode in ("direct", "ee")}
    root = study(tmp_path / "two", data)
    comparison = compare_people(CompareConfig(study=str(root)))
    assert not any(each.interval for each in comparison.values)
    assert all(each.interval is each.p is each.p_adjusted is None for each in comparison.contrasts)
    assert (
        "Participants: 2. Intervals and tests need 5 or more, so there are none."
        in people_report(comparison).cautions
    )


def test_a_missing_score_is_missing_and_counted(six):
    sus = of(six[1].values, FORMS, "sus")["ee"]
    assert (sus.counts, len(sus.values), sus.estimate) == ((5,), 6, pytest.approx(83.0))
    assert of(six[1].contrasts, FORMS, "sus")["direct"].estimate == pytest.approx(-33.0)
    raw = of(six[1].values, FORMS, "tlx_raw").values()
    assert all(mean.estimate is None and mean.counts == (0,) for mean in raw)
    assert "missing" in ran("--study", six[0], "--output", six[0] / "out", name="compare")


def test_scripted_operators_stand_beside_people_and_are_not_tested(six, tmp_path):
    episodes = [("", scene, 30, True) for scene in range(5)]
    beside = dataset(tmp_path / "scripts", "reach", "ee", episodes, operator="scripted")
    comparison = compare_people(CompareConfig(datasets=(str(beside),), study=str(six[0]), baseline="ee"))
    times = of(comparison.values, "reach", "completion_time").values()
    counts = [(mean.label, *mean.counts) for mean in times]
    assert counts == [("direct", 6), ("ee", 6), ("ee, scripted", 5)]
    assert list(comparison.contrasts) == list(six[1].contrasts)
    told = people_report(comparison).cautions
    assert any(text.startswith("Scripted operators stand beside") for text in told)
    undos = of(comparison.values, "reach", "undos")
    assert undos["ee, scripted"].estimate is None  # nobody held a device
    assert undos["ee"].estimate == 1.0


@pytest.mark.parametrize(("name", "got"), [("P1", "participant 'P1'"), ("", "'browser'")])
def test_people_are_no_scripts(name, got, six, tmp_path):
    beside = dataset(tmp_path / "beside", "reach", "ee", [(name, 7, 30, True)])
    with pytest.raises(HandrailError, match=f"expected a scripted operator, got {got}"):
        compare_people(CompareConfig(datasets=(str(beside),), study=str(six[0])))


def test_demo_data_say_so_above_every_table(tmp_path):
    data = {
        (task, mode): people(1, lambda place: 40) for task in ("reach", "tray") for mode in ("direct", "ee")
    }
    root = study(tmp_path / "demo", data, ["P1,ee,sus,80"], demo=True)
    said = ran("--study", root, "--output", tmp_path / "out", name="compare")
    tables = 6  # means and differences of two tasks and the forms
    assert said.count(DEMO) == tables
    assert (tmp_path / "out" / "report.html").read_text().count(f"<h3>{DEMO}") == tables
    told = json.loads((tmp_path / "out" / "report.json").read_text())
    assert told["source"] == DEMO
    assert told["demo"] is True
    for name in ("trials.csv", "differences.csv"):
        rows = list(csv.DictReader((tmp_path / "out" / name).read_text().splitlines()))
        assert rows
        assert {row["source"] for row in rows} == {DEMO}


def test_scores_that_say_so_make_it_demo_data(tmp_path):
    root = study(tmp_path / "study", {("reach", "ee"): people(1, lambda place: 40)})
    write_scores(root, ["participant,condition,score,value,source", f"P1,ee,tlx_raw,,{DEMO}"])
    comparison = compare_people(CompareConfig(study=str(root)))
    assert comparison.study.demo
    assert of(comparison.values, FORMS, "tlx_raw")["ee"].counts == (0,)


HEAD = "participant,condition,score,value"
WRONG = [
    ((f"{HEAD},mood", "P1,ee,sus,80,good"), "expected the columns"),
    ((HEAD, "P1,ee,sus,nan"), "line 2: value: expected a number >= 0.*, got nan"),
    ((HEAD, "P1,ee,sus,good"), "value: expected a number"),
    ((HEAD, "P1,ee,sus,80", "P1,ee,sus,80"), "P1 ee sus twice"),
    ((HEAD, "P1,ee,mood,80"), "score: expected one of tlx_raw, tlx_weighted, sus, got 'mood'"),
    ((HEAD, ",ee,sus,80"), "line 2: expected 4 values"),
    ((f"{HEAD},source", "P1,ee,sus,80,me"), "source: expected one of people, .*, got 'me'"),
    (("",), "expected the columns"),
]


@pytest.mark.parametrize(("lines", "words"), WRONG)
def test_a_wrong_score_is_refused(lines, words, tmp_path):
    write_scores(tmp_path, lines)
    with pytest.raises(HandrailError, match=words):
        read_scores(tmp_path / "exports" / "scores.csv")


@pytest.mark.parametrize("hidden", [".ee.old", ".ee.partial"])
def test_folders_of_an_erasure_that_was_cut_short_are_no_conditions(hidden, tmp_path):
    root = study(tmp_path / "study", {("reach", "ee"): [("P001", 1, 5, True)]}, ["P001,ee,sus,50"])
    shutil.copytree(root / "data" / "reach" / "ee", root / "data" / "reach" / hidden)
    assert list(read_study(root).datasets) == [("reach", "ee")]


def test_no_bytes_make_a_traceback(tmp_path):
    path = tmp_path / "scores.csv"
    for data in (b"\xff\xfe", b"\x00", b'"open', b"participant,condition,score,value\n\x00"):
        path.write_bytes(data)
        with pytest.raises(HandrailError, match=r"scores\.csv"):
            read_scores(path)


def test_a_wrong_study_is_one_clear_line(tmp_path, six):
    for content, said in (
        (None, "expected the study.json"),
        ('{"demo": "yes"}', "expected demo to be true or false, got 'yes'"),
        ("[]", "expected demo to be true or false"),
        ("{}", "expected datasets in data/TASK/MODE"),
    ):
        if content is not None:
            (tmp_path / "study.json").write_text(content)
        refused("--study", tmp_path, name="compare", told=said)
    unknown = "unknown baseline 'joints': expected one of direct, ee"
    refused("--study", six[0], "--baseline", "joints", name="compare", told=unknown)
    refused("--study", six[0], "--by", "mode", name="compare", told="--by: expected it without --study")
    root = study(tmp_path / "study", {("reach", "ee"): people(1, lambda place: 40)}, ["P1,joints,sus,80"])
    refused("--study", root, name="compare", told="unknown condition 'joints': expected one of ee")
