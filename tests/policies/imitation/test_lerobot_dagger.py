"""A person corrects a policy in LeRobot's rollout (DAgger), with its keys, in a terminal of the test."""

import os
import re
import shlex
import sys
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from canned import canned, record_by_command
from lerobot.rollout.strategies.dagger import DAggerEvents
from lerobot.scripts import lerobot_rollout
from places import ROOT
from training_helpers import tiny

import handrail.policies.lerobot  # noqa: F401  (as LeRobot's command line has it)
from handrail.collect.lerobot import HandrailSim
from handrail.datasets.reading.reader import read_episodes, read_frames
from handrail.policies.imitation.training.training import train

pytestmark = [pytest.mark.slow, pytest.mark.needs_gl, pytest.mark.filterwarnings("default")]
PAUSE, CORRECT, STOP = " ", "\t", "\x1b"
KEYS = (PAUSE, CORRECT, CORRECT, PAUSE) * 2 + (STOP,)
EACH = 30  # periods of a phase
ROUNDING = 1e-4  # of what is sent, over the limits


@pytest.fixture(scope="module")
def policy(tmp_path_factory):
    recorded = canned(record_by_command, "--task reach --dataset.num_episodes 2")
    output = tmp_path_factory.mktemp("intents") / "policy"
    return train(tiny(recorded, output, actions="intent", steps=40))


class Periods:
    """Presses the next key a while after the last one was heeded; keeps what the robot was sent."""

    def __init__(self, terminal):
        self._terminal, self._keys, self._since = terminal, list(KEYS), 0
        self.phase, self.kept = "autonomous", []

    def heeded(self, transition):
        if transition is not None:
            self.phase, self._since = transition[1].value, 0
        return transition

    def over(self, robot, action):
        if not robot.action.is_in(action):
            return  # LeRobot leads the robot back
        self.kept.append((self.phase, robot.episodes, robot.view.state.time, robot.loop.now.info["sent"]))
        self.limits = robot.env.model.description.limits
        self._since += 1
        if self._since >= EACH and self._keys:
            os.write(self._terminal, self._keys.pop(0).encode())
            self._since = -sys.maxsize if self._keys else 0  # until it is heeded


def page_s_command():
    """Return the page's command that collects corrections, as settings by name."""
    page = (ROOT / "docs" / "lerobot.md").read_text().replace("\\\n", " ")
    (words,) = re.findall(r"^lerobot-rollout (--strategy.type=dagger .*)$", page, re.MULTILINE)
    return dict(word.removeprefix("--").split("=", 1) for word in shlex.split(words))


@pytest.fixture
def corrected(policy, monkeypatch, tmp_path):
    """Run the page's command with a script that corrects; return its periods and its dataset's frames."""

    def run_it(**more):
        master, slave = os.openpty()
        periods, sent, consumed = Periods(master), HandrailSim.send_action, DAggerEvents.consume_transition

        def send(robot, action):
            done = sent(robot, action)
            periods.over(robot, action)
            return done

        said = page_s_command() | {"teleop.type": "handrail_scripted", "policy.path": policy, "fps": 1000}
        said |= {"robot.realtime": "false", "dataset.root": tmp_path / "set", "play_sounds": "false"}
        said |= {"robot.calibration_dir": tmp_path, "teleop.calibration_dir": tmp_path, "duration": 300}
        said |= {name.replace("__", "."): value for name, value in more.items()}
        words = (f"--{name}={value}" for name, value in said.items())
        with os.fdopen(slave) as terminal, monkeypatch.context() as patch:
            patch.delenv("DISPLAY", raising=False)
            patch.setattr(sys, "stdin", terminal)
            patch.setattr(sys, "argv", ["lerobot-rollout", *words])
            patch.setattr(HandrailSim, "send_action", send)
            patch.setattr(DAggerEvents, "consume_transition", lambda self: periods.heeded(consumed(self)))
            lerobot_rollout.main()
        os.close(master)
        columns, root = ["intervention", "action", "observation.state"], Path(tmp_path / "set")
        return periods, [read_frames(root, number, columns) for number in range(len(read_episodes(root)))]

    return run_it


@pytest.mark.parametrize("smooth", ["true", "false"])
@pytest.mark.parametrize("everything", [True, False], ids=["all frames", "corrections"])
def test_a_policy_is_corrected_without_a_jerk_and_the_dataset_says_so(everything, smooth, corrected):
    periods, episodes = corrected(
        strategy__record_autonomous=str(everything).lower(), strategy__smooth_handover=smooth
    )
    runs = [(phase, list(each)) for phase, each in groupby(periods.kept, key=lambda period: period[0])]
    order = [phase for phase, _ in runs]
    assert order == ["autonomous", "paused", "correcting", "paused"] * 2 + ["autonomous"]
    size, most = len(periods.limits.acceleration), periods.limits.acceleration * (1 + ROUNDING)
    for before, after in zip(periods.kept, periods.kept[1:], strict=False):
        if before[1] == after[1]:  # in one scene
            assert np.all(np.abs(after[3] - before[3])[:size] <= most / 20 + ROUNDING)
    for phase, run in runs:
        moves = np.abs([sent[:size] for *_, sent in run]).max(axis=1)
        if phase == "paused":  # it comes to rest, if it moved, and time stands still
            assert not moves[-3:].any()
            assert len({time for *_, time, _ in run[-3:]}) == 1
        else:
            assert moves.max() > 1e-3

    helped = [len(run) for phase, run in runs if phase == "correcting"]
    marks = [frames["intervention"].ravel() for frames in episodes]
    if everything:
        (marks,) = marks
        expected = [(phase == "correcting", len(run)) for phase, run in runs if phase != "paused"]
        assert [(bool(mark), len(list(each))) for mark, each in groupby(marks)] == expected
    else:
        assert [len(each) for each in marks] == helped
        assert all(each.all() for each in marks)
    assert all(np.abs(frames["action"][:, :6]).max() > 1e-3 for frames in episodes)
