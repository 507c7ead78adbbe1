"""The work of steering is measured on what was asked for: neither pauses nor what a device reads are work."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from collect_helpers import recording

from handrail.collect.config import SessionConfig
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.session.build import build_env
from handrail.collect.session.session import Session
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent, RawInput
from handrail.datasets.format.schema import Feature
from handrail.datasets.quality import effort
from handrail.datasets.reading.demonstration import Demonstration
from handrail.datasets.reading.load import read_demonstrations
from handrail.datasets.reading.reader import DatasetInfo


class Person:
    """Asks for velocities of joints, (m,), while a device reads others; then says what is in `says`."""

    def __init__(self, channels, values, raw, says):
        self._mask, self._values, self._says = channels.mask("joint"), values, says
        self._raw = RawInput(raw, 1, 0, "leader_arm", 0.0, 0.0)

    def reset(self, view, rng):
        self._asked = 0

    def act(self, view):
        self._asked += 1
        asked = Intent(self._values, self._mask, time=view.state.time, raw=self._raw)
        return self._says.get(self._asked, asked)


@pytest.mark.parametrize(
    ("speed", "reading", "expected"),
    [(0.0, 1.5, (0.0, 0.0)), (0.2, 0.0, (0.0, 1.0))],
    ids=["a leader arm that is held still", "a base that is driven among the joints"],
)
def test_work_is_what_was_asked_for_and_pauses_are_none(tmp_path, speed, reading, expected):
    """Mode switches and active axes of an episode with a pause."""
    env = build_env(SessionConfig(task="reach", physics=False, mode="direct"), 20)
    channels = Channels.of(env.model.description)
    values, raw = np.zeros(channels.size), np.full(channels.size, reading)
    values[channels.joint_slice.start] = speed
    says = dict.fromkeys(range(20, 60), EpisodeEvent.PAUSE) | {80: EpisodeEvent.SUCCESS}
    with recording(tmp_path / "d", env) as recorder:
        person = Person(channels, values, raw, says)
        recorder.end(Session(env, DirectController(env.model, env.period), person, [recorder]).run(3))
    env.close()
    (episode,) = read_demonstrations(tmp_path / "d")
    scale: Any = SimpleNamespace(input_scale=np.full(channels.size, 0.2))
    assert effort.mode_switches.measure(episode, scale) == expected[0]
    assert effort.active_axes.measure(episode, scale) == pytest.approx(expected[1], abs=0.2)


def test_a_gripper_that_is_pressed_beside_a_policy_is_no_switch(tmp_path):
    """It is the person's for a moment; the axes stay with the policy, or the person."""
    names, owner = ("base.vx", "ee.vx", "gripper"), np.array([[2, 1, 1], [2, 1, 2], [2, 1, 1], [2, 2, 2]])
    info = DatasetInfo(tmp_path, 10, "arm", {"owner": Feature("int8", (3,), names)}, 1, 1, "", "", True)
    episode = Demonstration(0, info, {"owner": owner}, {"length": 4})
    assert effort.mode_switches.measure(episode, SimpleNamespace()) == 1.0
