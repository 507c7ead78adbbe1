"""Real recordings with local devices: a terminal, a gamepad of SDL's, a leader that plays back."""

import io
import sys
import threading
import time

import numpy as np
import pyarrow.parquet as pq
import pytest
from command_helpers import command, refused
from device_players import HID, PlayedHid, recorded
from judges import doctor_fails, lint_defects
from played_leader import CALIBRATION, PLAYED
from terminal_player import TerminalPlayer

from handrail.collect.devices.calibration import calibration_file, save_calibration
from handrail.collect.devices.local_person import LocalPerson
from handrail.collect.teleop_config import LeaderConfig

LEADER = ("--operator", "leader_arm", "--teleop.type", "played_leader")
BESIDE = ("--policy", "none")
MULTIPLEXERS = ("TMUX", "STY", "ZELLIJ")


def frames(folder):
    """Return the columns of all episodes."""
    tables = [pq.read_table(path).to_pydict() for path in sorted(folder.glob("data/**/*.parquet"))]
    return {name: [value for table in tables for value in table[name]] for name in tables[0]}


def episodes(folder):
    return sum(len(pq.read_table(path)) for path in folder.glob("meta/episodes/**/*.parquet"))


@pytest.mark.slow
def test_a_reach_with_the_keys_of_a_terminal_and_lerobots_keys(tmp_path):
    folder = tmp_path / "dataset"
    words = [str(folder), "--task", "reach", "--operator", "keyboard", "--dataset.num_episodes", "5"]
    with TerminalPlayer(*words) as player:
        player.until("press enter to begin", 300.0)
        player.press("\r")
        time.sleep(0.5)  # all is let go
        player.go_to_the_goal()
        player.until("press enter to begin")
        for key, ends in (("\x1b[D", "press enter to begin"), ("\x1b[C", "last episode saved")):
            player.press("\r")
            time.sleep(0.5)
            player.press("w")
            time.sleep(0.5)
            player.press(key)  # ← begins it again, → ends it
            player.until(ends)
        player.press("\x1b")  # Esc ends the recording
        assert player.ended() == 0
    seen = frames(folder)
    assert episodes(folder) == 2
    assert set(seen["teleop.device"]) == {"keyboard"}
    assert 0.0 <= min(seen["teleop.age"]) <= max(seen["teleop.age"]) <= 0.25
    assert np.any(seen["teleop.raw"])
    assert max(seen["episode_index"]) == 1


@pytest.fixture
def listens(monkeypatch):
    """Say when a person is asked for the first time: what comes before can take minutes on a new machine."""
    event, act = threading.Event(), LocalPerson.act

    def first(person, view):
        event.set()
        return act(person, view)

    monkeypatch.setattr(LocalPerson, "act", first)
    return event


def played_by(listens, steps, *arguments):
    """Record while somebody does one step after the other, each after some time [s]."""

    def play():
        assert listens.wait(500.0)
        for wait, step in steps:
            time.sleep(wait)
            step()

    hands = threading.Thread(target=play)
    hands.start()
    done = command(*arguments)
    hands.join()
    return done


@pytest.mark.slow
def test_a_recording_with_a_gamepad(tmp_path, pad, listens):
    folder = tmp_path / "dataset"
    steps = [
        (0.0, lambda: pad.move("left_shoulder", 1)),
        (0.3, lambda: pad.move("start", 1)),
        (0.1, lambda: pad.move("start", 0)),
        (0.5, lambda: pad.move("left_y", -1.0)),
        (1.0, lambda: pad.move("left_shoulder", 0)),  # brakes, and nothing is recorded
        (1.0, lambda: pad.move("y", 1)),
        (0.2, lambda: pad.move("y", 0)),
    ]
    flags = ["--task", "reach", "--operator", "gamepad", "--dataset.num_episodes", "1"]
    done = played_by(listens, steps, folder, *flags)
    assert done.returncode == 0, done.stderr
    seen = frames(folder)
    assert set(seen["teleop.device"]) == {"gamepad"}
    assert max(seen["teleop.age"]) <= 0.25
    driven = np.array(seen["teleop.raw"])[:, 3]
    assert driven.max() == 1.0
    assert driven[0] == 0.0
    assert np.diff(np.array(seen["wall_clock"])).max() > 0.3  # the pause is a gap
    assert seen["next.done"][-1]
    assert not doctor_fails(folder)
    assert not lint_defects(folder)


@pytest.mark.slow
def test_a_recording_with_a_leader_arm_and_a_gamepad(tmp_path, pad, listens, monkeypatch):
    monkeypatch.setattr("lerobot.utils.constants.HF_LEROBOT_CALIBRATION", tmp_path / "calibration")
    monkeypatch.setattr("lerobot.teleoperators.teleoperator.HF_LEROBOT_CALIBRATION", tmp_path / "calibration")
    save_calibration(CALIBRATION, calibration_file(LeaderConfig(type="played_leader"), "ridgeback_ur10"))
    actions = [event["action"] for event in recorded("leader.json")]
    PLAYED.actions, PLAYED.last, PLAYED.plugged = [], actions[0], True
    folder = tmp_path / "dataset"

    def turn():
        PLAYED.actions = [action for action in actions for _ in range(5)]

    steps = [
        (0.3, lambda: pad.move("start", 1)),
        (0.2, lambda: pad.move("start", 0)),
        (0.5, lambda: pad.move("right_shoulder", 1)),
        (0.5, turn),
        (2.0, lambda: pad.move("y", 1)),
        (0.2, lambda: pad.move("y", 0)),
    ]
    flags = ("--task", "reach", "--mode", "leader", "--teleop.beside", "gamepad")
    done = played_by(listens, steps, folder, *LEADER, *flags, "--dataset.num_episodes", "1")
    assert done.returncode == 0, done.stderr
    seen = frames(folder)
    state = np.array(seen["observation.state"])
    assert set(seen["teleop.device"]) == {"played_leader"}
    assert max(seen["teleop.age"]) <= 0.25
    turned = np.degrees(state[-1, 3] - state[0, 3])
    assert turned == pytest.approx(actions[-1]["shoulder_pan.pos"] - actions[0]["shoulder_pan.pos"], abs=2.0)


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (("--operator", "leader_arm"), "--operator leader_arm: expected --teleop.type, such as"),
        (("--teleop.type", "so101_leader"), "expected --operator leader_arm, got scripted"),
        (("--operator", "gamepad", "--teleop.map", "no.toml"), "expected a .toml file, found none"),
        (("--operator", "gamepad", "--teleop.dead_zone", "0.9"), "expected a number <= 0.5, got 0.9"),
        ((*LEADER, "--teleop.beside", "mouse"), "Expected one of ('keyboard', 'gamepad')"),
        ((*LEADER, "--mode", "ee"), "expected a mode that steers every joint of the arm: joints, direct,"),
        ((*LEADER, "--mode", "direct_single"), "leader; got direct_single"),
        ((*LEADER, "--mode", "leader", "--teleop.id", "new"), "expected a calibration of the leader arm for"),
        (("--operator", "spacemouse"), "SpaceMouse: expected one, found none; plug it in"),
        (("--operator", "keyboard"), "keyboard: expected a terminal to read keys from"),
        (("--operator", "keyboard", *BESIDE), "keyboard: expected a terminal to read keys from"),
        (("--operator", "spacemouse", *BESIDE), 'spacemouse beside --policy: expected a control to "hold"'),
    ],
)
def test_impossible_settings_are_one_line_and_nothing_is_written(tmp_path, monkeypatch, flags, said):
    hid = PlayedHid()
    hid.plugged = False
    monkeypatch.setitem(sys.modules, HID, hid)
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    for name in MULTIPLEXERS:
        monkeypatch.delenv(name, raising=False)
    refused(tmp_path / "dataset", "--task", "reach", *flags, told=said)
    assert not (tmp_path / "dataset").exists()


def test_a_spacemouse_with_a_button_to_hold_may_be_beside_a_policy(tmp_path, monkeypatch):
    """It comes as far as the plug: a person's own dead-man will do."""
    hid = PlayedHid()
    hid.plugged = False
    monkeypatch.setitem(sys.modules, HID, hid)
    (tmp_path / "mine.toml").write_text('[actions]\nbutton_1 = "hold"\n')
    words = ("--operator", "spacemouse", *BESIDE, "--teleop.map", tmp_path / "mine.toml")
    refused(tmp_path / "dataset", "--task", "reach", *words, told="SpaceMouse: expected one, found none")


@pytest.mark.parametrize("name", MULTIPLEXERS)
@pytest.mark.parametrize("operator", ["keyboard", "leader_arm"])
def test_a_device_that_answers_for_a_hanging_terminal_is_refused_beside_a_policy(
    tmp_path, monkeypatch, name, operator
):
    monkeypatch.setenv(name, "/tmp/socket,1,0")
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    monkeypatch.setattr("lerobot.utils.constants.HF_LEROBOT_CALIBRATION", tmp_path / "calibration")
    save_calibration(CALIBRATION, calibration_file(LeaderConfig(type="played_leader"), "ridgeback_ur10"))
    flags = ("--operator", operator) if operator == "keyboard" else (*LEADER, "--mode", "joints")
    refused(
        tmp_path / "dataset",
        *("--task", "reach", *flags, *BESIDE),
        told="keyboard beside --policy: expected a terminal itself, got tmux",
    )
