"""A law of devices beside a policy, from the command line: what is moved is the person's until let go."""

import threading
import time

import pytest
from command_helpers import command
from device_players import recorded
from played_leader import CALIBRATION, PLAYED
from policy_helpers import untrained_act

from handrail.collect.devices.calibration import calibration_file, save_calibration
from handrail.collect.operators.shared.shared_operator import SharedOperator
from handrail.collect.teleop_config import LeaderConfig
from handrail.controllers.interface.sources import Intents

pytestmark = pytest.mark.slow
GAMEPAD = ("--operator", "gamepad", "--mode", "ee")
LEADER = ("--operator", "leader_arm", "--teleop.type", "played_leader", "--teleop.beside", "gamepad")


class Watched:
    """Who drives, at every call of the shared operator, and what to do next when that is so."""

    def __init__(self, monkeypatch, steps):
        self.seen, self._steps, act = [], iter(steps), SharedOperator.act
        self._asked = threading.Event()

        def watched(operator, view):
            answer = act(operator, view)
            self._asked.set()
            if isinstance(answer, Intents):
                owners = {each.name for each in answer.sources if each.share().any()}
                self.seen.append("+".join(sorted(owners)))
            return answer

        monkeypatch.setattr(SharedOperator, "act", watched)
        self._hands = threading.Thread(target=self._play)

    def record(self, *words):
        self._hands.start()
        done = command(*words)
        self._hands.join()
        assert done.returncode == 0, done.stderr

    def _play(self):
        assert self._asked.wait(500.0)
        for do, come in self._steps:
            do()
            end = time.monotonic() + 60.0
            while come and not (self.seen and come in self.seen[-1]) and time.monotonic() < end:
                time.sleep(0.02)
            time.sleep(0.3)


@pytest.mark.parametrize(
    ("flags", "mine", "held"), [(GAMEPAD, "person", "left_shoulder"), (LEADER, "person", "")]
)
def test_moving_a_device_takes_over_and_gives_back(tmp_path, pad, monkeypatch, flags, mine, held):
    for place in ("lerobot.utils.constants", "lerobot.teleoperators.teleoperator"):
        monkeypatch.setattr(f"{place}.HF_LEROBOT_CALIBRATION", tmp_path / "calibration")
    save_calibration(CALIBRATION, calibration_file(LeaderConfig(type="played_leader"), "ridgeback_ur10"))
    actions = [event["action"] for event in recorded("leader.json")]
    PLAYED.actions, PLAYED.last, PLAYED.plugged = [], actions[0], True

    def move():
        pad.move("left_y", -1.0)
        pad.move("right_shoulder", 1)  # the clutch of a leader
        PLAYED.actions = [action for action in actions for _ in range(8)]

    def let_go():
        pad.move("left_y", 0.0)
        pad.move("right_shoulder", 0)

    steps = [
        (lambda: held and pad.move(held, 1), ""),
        (lambda: pad.move("start", 1), "policy"),
        (lambda: pad.move("start", 0), "policy"),
        (move, mine),
        (let_go, "policy"),
        (lambda: pad.move("y", 1), ""),
        (lambda: pad.move("y", 0), ""),
    ]
    mode = ("--mode", "joints") if flags is LEADER else ()
    watched = Watched(monkeypatch, steps)
    policy = untrained_act(tmp_path / "act", "intent")
    words = ("--task", "reach", "--policy", policy, "--dataset.num_episodes", "1")
    watched.record(tmp_path / "dataset", *flags, *mode, *words)
    owners = [
        each
        for each, before in zip(watched.seen, [None, *watched.seen], strict=False)
        if each and each != before
    ]
    print(owners)
    first = next(number for number, each in enumerate(owners) if "person" in each)
    assert "policy" in owners[:first]
    assert "policy" in owners[first:]
