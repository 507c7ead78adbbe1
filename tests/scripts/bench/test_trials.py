"""The laws of trials: stopped and gone on is the same as run through; a table says what the episodes were."""

from dataclasses import replace
from pathlib import Path

import pytest

from handrail.controllers.errors import HandrailError
from handrail.scripts.bench.operators.trials import TrialsConfig, run_trials, trials_file


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    path = tmp_path_factory.mktemp("trials") / "new" / "trials.json"
    settings = {"episodes": 3, "persons": 2, "noise": 0.5, "workers": 1}
    return TrialsConfig(tasks="reach", modes="ee,decoupled", json=str(path), **settings)


@pytest.fixture(scope="module")
def trials(config):
    return run_trials(config, lambda trial: None)


def test_stopped_and_gone_on_is_the_same_as_run_through(config, trials, tmp_path):
    other = replace(config, json=str(tmp_path / "trials.json"))

    def stop(trial):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_trials(other, stop)
    run_trials(replace(other, modes="decoupled", episodes=1), lambda trial: None)
    ran = []
    run_trials(other, ran.append)
    assert [(trial.mode, trial.episode) for trial in ran] == [
        *(("ee", 1), ("ee", 2), ("decoupled", 1), ("decoupled", 2)),
    ]
    assert (tmp_path / "trials.json").read_bytes() == Path(config.json).read_bytes()
    run_trials(other, lambda trial: pytest.fail("ran again"))


def test_persons_take_turns_and_only_who_switches_loses_time(trials):
    assert [trial.person for trial in trials] == [0, 1, 0] * 2
    steering, driving = trials[:3], trials[3:]
    assert all(trial.success and 0 < trial.seconds < 30 for trial in trials)
    assert all(trial.switches == 0 and trial.switching == 0 for trial in steering)
    assert any(trial.switches for trial in driving)
    for trial in driving:
        assert (trial.switching > 0) == (trial.switches > 0)
        assert trial.switching < min(trial.seconds, 0.5 * trial.switches + 1e-9)


@pytest.mark.parametrize("wrong", [{"seed": 1}, {"noise": 2.0}, {"persons": 3}, {"robot": "ridgeback_panda"}])
def test_trials_of_other_settings_are_not_mixed(config, trials, wrong):
    with pytest.raises(HandrailError, match="choose another file"):
        run_trials(replace(config, **wrong), lambda trial: None)


def test_another_file_is_left_alone(config, tmp_path):
    path = tmp_path / "other.json"
    for content in ("[1]", "{", '{"format": "else"}'):
        path.write_text(content)
        with pytest.raises(HandrailError, match="--json"):
            trials_file(replace(config, json=str(path)))
        assert path.read_text() == content


@pytest.mark.parametrize("robot", ["lekiwi", "ridgeback_panda"])
def test_all_modes_are_those_whose_controller_drives_the_robot(robot):
    names = TrialsConfig(robot=robot, modes="all").mode_names
    assert {"ee", "direct"} <= set(names)
    assert "rl" not in names
