"""The fit of the scripted operator: what it looks at, what it cannot tell, and what it says."""

import json
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from command_helpers import command

from handrail.collect.config import RecordConfig
from handrail.collect.experiments.operator_fit.episodes import check_alike, read_steered
from handrail.collect.experiments.operator_fit.fit import Estimate, Fit, Likeness, believed
from handrail.collect.experiments.operator_fit.parameters import PARAMETERS, untold
from handrail.collect.experiments.operator_fit.regression import Regression
from handrail.collect.experiments.operator_fit.report import as_json, fit_table, flags, sentences, throughput
from handrail.collect.experiments.operator_fit.shadow import Shadow
from handrail.collect.experiments.operator_fit.statistics import NAMES, resampled, statistics, sums
from handrail.collect.operators.human.human import HumanSettings
from handrail.controllers.errors import HandrailError
from handrail.scripts import cli

FPS = 20
REACH = ("--task", "reach", "--no_physics", "--dataset.num_episodes", "2")


def record(root, *arguments):
    done = command(*REACH, "--dataset.root", root, *arguments)
    assert done.returncode == 0, done.stderr
    return root


@pytest.fixture(scope="module")
def perfect(tmp_path_factory):
    """Two episodes of an operator without any weakness, who is brisk."""
    root = tmp_path_factory.mktemp("recorded") / "perfect"
    record(root, "--noise", "0", "--human.briskness", "1.5")
    return list(read_steered(root))


def test_an_operator_who_sees_the_same_does_the_same(perfect):
    human = replace(HumanSettings.perfect(), briskness=1.5)
    for episode in perfect:
        inputs, owned = Shadow(episode).inputs(human, np.random.default_rng(0))
        assert inputs == pytest.approx(episode.inputs, abs=1e-4)
        assert np.array_equal(owned, episode.owned)
        slower, _ = Shadow(episode).inputs(HumanSettings.perfect(), np.random.default_rng(0))
        assert np.abs(slower - episode.inputs).max() > 0.1


def test_a_delay_is_seen_from_the_first_push_on(perfect):
    shadow = Shadow(perfect[0])
    late, _ = shadow.inputs(replace(HumanSettings.perfect(), delay=0.3), np.random.default_rng(0))
    assert late[0].any()
    assert late[6:] == pytest.approx(shadow.wanted[:-6], abs=1e-9)  # 0.3 s are six frames


def test_a_speed_level_is_no_briskness(perfect, tmp_path):
    episode = perfect[0]
    assert episode.gains.hand_speed == pytest.approx(0.35, rel=1e-4)
    assert np.linalg.norm(episode.inputs, axis=1).max() <= 2.0


def test_keys_are_taken_for_keys(perfect):
    keyed = replace(perfect[0], inputs=np.sign(np.round(perfect[0].inputs)), keys=True)
    inputs, _ = Shadow(keyed).inputs(HumanSettings(), np.random.default_rng(0))
    assert set(np.unique(inputs)) <= {-1.0, 0.0, 1.0}
    reasons = untold([keyed])
    told = {each.name for each in PARAMETERS} - set(reasons)
    assert told == {"delay", "refractory", "briskness"}
    assert reasons["noise"].startswith("keys are on or off")
    with pytest.raises(HandrailError, match="expected one device, got a script"):
        check_alike([keyed, perfect[1]])


def test_what_never_happened_is_not_told(perfect):
    reasons = untold(perfect)
    assert reasons["switch_time"] == "the operator never changed to other channels"
    assert {"persons", "moods"} <= set(reasons)
    owned = perfect[0].owned.copy()
    owned[10:] = ~owned[10:]
    assert "switch_time" not in untold([replace(perfect[0], owned=owned)])


def of(inputs, wanted=None, owned=None):
    wanted = np.ones_like(inputs) if wanted is None else wanted
    owned = np.ones(inputs.shape, dtype=bool) if owned is None else owned
    found = statistics(sums(inputs, wanted, owned, FPS)[None])
    return dict(zip(NAMES, found, strict=True))


def test_statistics_tell_a_delay_and_a_rhythm():
    rng = np.random.default_rng(1)
    wanted = np.cumsum(rng.normal(size=(400, 3)), axis=0)
    late = np.vstack([wanted[:6] * 0.0 + wanted[0], wanted[:-6]])
    found = of(late, wanted)
    misses = [name for name in NAMES if name.startswith("miss")]
    assert min(misses, key=lambda name: found[name]) == "miss, 0.3 s late"
    assert found["delay of the best match [s]"] == pytest.approx(0.3, abs=0.01)
    steps = np.repeat(rng.normal(size=(60, 3)), 8, axis=0)  # held for 0.4 s: nothing changes in between
    beats = of(steps)
    assert beats["frames without a change"] > 0.85
    assert beats["change that comes in bursts"] == pytest.approx(1.0)
    every = np.tile(np.eye(8)[:, :1], (60, 1)) * 1.0  # pushed for a moment, every 0.4 s
    assert of(every)["rhythm at 0.4 s"] > of(every)["rhythm at 0.3 s"]


def test_statistics_do_not_depend_on_the_axes_of_a_twist():
    rng = np.random.default_rng(2)
    inputs, wanted = rng.normal(size=(2, 60, 3))
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    one, other = of(inputs, wanted), of(inputs @ turn, wanted @ turn)
    for name in NAMES:
        if not name.startswith("noise"):
            assert one[name] == pytest.approx(other[name]), name


def test_time_after_a_switch():
    inputs, owned = np.zeros((40, 2)), np.zeros((40, 2), dtype=bool)
    owned[:10, 0] = owned[10:, 1] = True
    inputs[:10, 0], inputs[16:, 1] = 1.0, 1.0
    assert of(inputs, owned=owned)["time to the first input after a switch [s]"] == pytest.approx(6 / FPS)


def test_resampling_the_episodes_is_about_what_all_of_them_say():
    rng = np.random.default_rng(3)
    owned = np.ones((60, 3), dtype=bool)
    drawn = rng.normal(size=(8, 2, 60, 3))
    each = np.array([sums(inputs, wanted, owned, FPS) for inputs, wanted in drawn])
    again = resampled(each, 500, rng)
    assert again.mean(axis=0) == pytest.approx(statistics(each), abs=0.2)
    assert again.std(axis=0).max() > 0.0
    assert resampled(each[:1], 5, rng) == pytest.approx(np.tile(statistics(each[:1]), (5, 1)))


def test_a_regression_finds_what_made_the_data_and_what_did_not():
    rng = np.random.default_rng(4)
    values = rng.uniform(-1.0, 1.0, size=(300, 3))
    linear, curved, _ = values.T
    known = np.column_stack(
        [linear + 0.05 * rng.normal(size=300), np.exp(2.0 * curved), rng.normal(size=300)]
    )
    found = Regression.of(known, values)
    spread = found.residuals.std(axis=0)
    assert spread[0] < 0.1
    assert spread[1] < 0.25
    assert spread[2] == pytest.approx(values[:, 2].std(), rel=0.1)
    assert found.predict(np.array([0.5, np.exp(1.0), 0.0]))[:2] == pytest.approx([0.5, 0.5], abs=0.15)


def fit(**changes):
    estimates = (
        Estimate("delay", "s", 0.2, 0.3, (0.25, 0.36)),
        Estimate("noise", "", 0.1, None, None, "the episodes do not tell it"),
        Estimate("briskness", "", 1.0, 2.0, (0.9, 2.5)),
    )
    found = Fit(12, 60.0, "gamepad", False, 1.2, estimates, HumanSettings(delay=0.3), Likeness(1.0, 4.0, ()))
    return replace(found, **changes)


def test_a_report_says_what_was_told_and_what_not():
    words = "\n".join(" ".join(map(str, row)) for row in fit_table(fit()).rows)
    assert "delay [s] 0.300 0.250 to 0.360 0.200 1.50 differs from the default" in words
    assert "noise not told – 0.100 – the episodes do not tell it" in words
    assert words.count("differs") == 1
    assert flags(fit()) == "--human.delay 0.3 --human.briskness 2 --human.persons 0"
    taken = cli.parse(RecordConfig, "handrail-record", flags(fit()).split()).human
    assert taken == HumanSettings(delay=0.3, briskness=2.0, persons=0.0)
    value, interval = throughput(fit()) or (0.0, None)
    assert interval
    assert (interval[0], value, interval[1]) == pytest.approx(
        (0.9 * 1.2 / np.log(2), 2.4 / np.log(2), 3.0 / np.log(2))
    )
    assert json.loads(json.dumps(as_json(fit(), ["one"])))["estimates"]["noise"]["value"] is None


def test_a_report_warns():
    assert not [text for text in sentences(fit(), []) if "Few" in text or "few" in text]
    assert any("Few episodes" in text for text in sentences(fit(episodes=8), []))
    assert any("Too few episodes for intervals" in text for text in sentences(fit(episodes=3), []))
    assert any("a script steered, no person" in text for text in sentences(fit(device=""), []))
    assert any("on or off" in text for text in sentences(fit(keys=True), []))
    unlike = Likeness(7.0, 9.0, (("mean input", -9.0),))
    assert any(
        "No scripted operator steers like that" in text for text in sentences(fit(likeness=unlike), [])
    )
    assert any("Left out: 1 episodes. why" in text for text in sentences(fit(), ["why"]))
    nothing = fit(estimates=(Estimate("briskness", "", 1.0, reason="no"),))
    assert list(sentences(nothing, []))[-1].startswith("Nothing was told")


def test_no_number_is_given_where_no_scripted_operator_steers_like_that():
    near, far = Likeness(1.9, 1.2, ()), Likeness(35.0, 11.0, ())
    assert believed(fit().estimates, near) == fit().estimates
    assert believed(fit().estimates, Likeness(8.0, 20.0, ())) == fit().estimates  # nearer than the default
    doubted = fit(estimates=believed(fit().estimates, far), likeness=far)
    assert not any(each.value or each.interval for each in doubted.estimates)
    assert doubted.estimates[0].reason.startswith("no scripted operator steers like this input")
    assert list(sentences(doubted, []))[-1].startswith("Nothing was told")
    assert any("The defaults are as near" in text for text in sentences(fit(likeness=near), []))


def refused(*arguments):
    done = command(*arguments, name="fit_operator")
    assert done.returncode == 2, done.stderr
    assert done.stderr.count("\n") == 1
    return done.stderr


def test_wrong_input_is_one_clear_line(perfect, tmp_path):
    assert "expected one folder or more" in refused()
    assert "not a LeRobot dataset" in refused(tmp_path)
    assert "--draws 3: expected a whole number >= 50" in refused(tmp_path, "--draws", "3")
    assert "expected a file that ends in .json" in refused(tmp_path, "--output", "fit.txt")
    root = record(tmp_path / "leader", "--mode", "leader")
    assert "expected a mode with velocity sticks" in refused(root)
    assert "got none that can be used" in refused(root, "--participant", "P1")


def test_a_dataset_is_not_trusted(tmp_path):
    root = record(tmp_path / "odd", "--dataset.num_episodes", "1")
    (file,) = root.glob("data/*/*.parquet")
    table = pq.read_table(file)

    def write(column, values):
        place = table.column_names.index(column)
        pq.write_table(table.set_column(place, column, pa.array(values)), file)

    write("teleop.mode", ["os:system"] * len(table))
    assert "os:system" in refused(root)
    raw = np.array(table["teleop.raw"].to_pylist(), dtype=np.float32)
    write("teleop.raw", np.where(raw == raw[-1], np.nan, raw).tolist())
    assert "none that can be used" in refused(root)


def test_briskness_is_no_weakness():
    human = HumanSettings(briskness=1.5)
    rng = np.random.default_rng(0)
    assert human.scaled(3.0).briskness == human.person(rng).briskness == human.episode(rng).briskness == 1.5
    assert HumanSettings.perfect().briskness == 1.0
    with pytest.raises(HandrailError, match="briskness: expected a number > 0"):
        HumanSettings(briskness=0.0)
