"""The clocks beside LeRobot's loop: phases follow its times, and no robot is faster than real time."""

import pytest

from handrail.collect.lerobot.mode_action import HOLD, NEXT
from handrail.collect.lerobot.scripted import EpisodeClock
from handrail.collect.lerobot.sim import Pace

PERIOD = 0.05


class Now:
    """A clock that moves when it is told to."""

    def __init__(self):
        self.time = 0.0

    def __call__(self):
        return self.time

    def sleep(self, seconds):
        self.time += seconds


@pytest.mark.parametrize("stall", [0.11, 0.3])
@pytest.mark.parametrize("late", [0.0, 0.004])
def test_the_scene_changes_in_every_reset_and_never_in_an_episode(stall, late):
    """A loop as LeRobot's: an episode, a reset, saving it; the teleoperator hears only of its own calls."""
    now, said = Now(), []
    clock = EpisodeClock(2.0, 1.0, 2 * PERIOD, now)
    for episode in range(4):
        for phase, length in (("episode", 2.0), ("reset", 1.0)):
            begun = now.time
            while now.time - begun < length:
                now.time += late
                said.append((episode, phase, clock.button(done=False)))
                now.time += PERIOD - late
        now.time += stall
    for episode in range(4):
        recorded = [what for number, phase, what in said if (number, phase) == (episode, "episode")]
        between = [what for number, phase, what in said if (number, phase) == (episode, "reset")]
        assert between.count(NEXT) == 1
        assert NEXT not in recorded
        assert set(recorded) == {""}
        assert "" not in between[2:]


def test_without_an_episode_s_time_the_task_decides():
    now = Now()
    clock = EpisodeClock(0.0, 1.0, 0.0, now)
    phases = []
    for step in range(60):
        phases.append(clock.button(done=20 <= step < 30))
        now.time += PERIOD
    changes = [phase for phase, before in zip(phases, [None, *phases], strict=False) if phase is not before]
    assert changes == ["", HOLD, NEXT, HOLD, ""]


@pytest.mark.parametrize("asked", [10.0, 20.0, 60.0, 1000.0])
def test_a_robot_is_never_faster_than_real_time_and_waits_for_nobody_who_keeps_time(asked):
    now = Now()
    slept = []
    pace = Pace(PERIOD, now, lambda seconds: (slept.append(seconds), now.sleep(seconds)))
    for _ in range(200):
        pace.wait()
        now.time += 1.0 / asked
    assert 200 * PERIOD - now.time <= PERIOD
    assert bool(slept) == (asked > 1 / PERIOD)
