"""Laws of the table of controls: Handrail's is right; a person's changes are checked, and win."""

import json
import re

import pytest
from places import ROOT

from handrail.collect.devices import gamepad, spacemouse
from handrail.collect.devices.control_map import ACTIONS, Steered, load_map
from handrail.collect.devices.key_bytes import NAMES
from handrail.controllers.errors import HandrailError

MAPS = ROOT / "collect" / "devices" / "maps"
PAGE = ROOT / "collect" / "cockpit" / "page" / "keymap.js"
CONTROLS = {"gamepad": gamepad.CONTROLS, "spacemouse": spacemouse.CONTROLS, "keyboard": NAMES}
ARM = tuple(f"joint.arm_{number}" for number in range(1, 7))
FIRST = ("a", "b", "x", "y", "left_shoulder", "right_shoulder", "left_trigger", "right_trigger")
BROWSER = {  # buttons there
    **dict(enumerate(FIRST)),
    **{8: "back", 9: "start", 11: "right_stick", 12: "up", 13: "down", 16: "guide"},
}


@pytest.mark.parametrize("device", CONTROLS)
def test_the_tables_of_handrail_pass_the_check_of_a_persons(device):
    table = load_map(device, CONTROLS[device], str(MAPS / f"{device}.toml"))
    assert table.moves["hand"]
    assert set(table.actions.values()) <= set(ACTIONS)


@pytest.mark.parametrize("device", CONTROLS)
@pytest.mark.parametrize(
    ("hand", "base", "arm"), [(True, False, ()), (False, True, ()), (True, True, ()), (False, True, ARM)]
)
def test_every_channel_of_every_mode_can_be_moved_both_ways(device, hand, base, arm):
    """In one bank or another; a stick has both ways, a key one."""
    banks = load_map(device, CONTROLS[device]).banks(Steered(hand, base, arm))
    moved = [(axis, sign) for bank in banks for axis, sign in bank.values()]
    wanted = {f"ee.{name}" for name in ("vx", "vy", "vz", "wx", "wy", "wz")} if hand else set()
    wanted |= {"base.vx", "base.vy", "base.wz"} if base else set()
    assert {axis for axis, _ in moved} == wanted | set(arm)
    if device == "keyboard":
        assert {(axis, -sign) for axis, sign in moved} == set(moved)


def test_banks_hold_what_no_two_controls_share():
    banks = load_map("gamepad", gamepad.CONTROLS).banks(Steered(False, True, ARM))
    assert [sorted(axis for axis, _ in bank.values()) for bank in banks] == [
        sorted(ARM[:4]),
        sorted(ARM[4:]),
        ["base.vx", "base.vy", "base.wz"],
    ]
    assert len(load_map("keyboard", NAMES).banks(Steered(False, True, ARM))) == 1


def test_the_gamepad_means_what_it_means_in_the_browser():
    page = re.sub(r" *//.*", "", PAGE.read_text())
    table = re.sub(r"(\w+):", r'"\1":', re.search(r"STICKS = (\{.*?\});", page, re.DOTALL)[1])
    sticks = json.loads(table.replace(",\n}", "\n}"))
    table, of_hands = (load_map("gamepad", gamepad.CONTROLS, hands=hands) for hands in (1, 2))
    for section, entries in sticks.items():
        ours = table.moves[section]
        assert {(gamepad.AXES[index], axis, sign) for index, axis, sign in entries} <= {
            (control, *move) for control, move in ours.items()
        }
    buttons = {name: int(index) for name, index in re.findall(r"(\w+): \{ says: .*?button: (-?\d+) \}", page)}
    up, down = (table.moves["both"][BROWSER[buttons[name]]] for name in ("up", "down"))
    assert (up, down) == (("ee.vz", 1), ("ee.vz", -1))
    known = {name: BROWSER[index] for name, index in buttons.items() if index in BROWSER}
    several = {name: known.pop(name) for name in ("hand", "grip_left", "grip_right")}
    assert {name: of_hands.actions[button] for name, button in several.items()} == {n: n for n in several}
    shared = {name: table.actions[button] for name, button in known.items() if name not in ("up", "down")}
    others = {"start": "start_or_pause", "deadman": "hold", "turn": "clutch"}
    assert shared == {name: others.get(name, name) for name in shared}
    assert others.keys() <= shared.keys()
    assert {"grip", "stop", "success", "failure", "restart", "undo", "focus"} <= set(shared)


def test_a_persons_changes_win_and_an_empty_text_takes_away(tmp_path):
    changes = tmp_path / "mine.toml"
    changes.write_text('[hand]\nleft_y = "ee.vz"\nleft_x = ""\n[actions]\na = "stop"\n')
    table = load_map("gamepad", gamepad.CONTROLS, str(changes))
    assert table.moves["hand"]["left_y"] == ("ee.vz", 1)
    assert "left_x" not in table.moves["hand"]
    assert table.actions["a"] == "stop"
    assert table.moves["base"] == load_map("gamepad", gamepad.CONTROLS).moves["base"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            '[arm]\na = "ee.vx"',
            "unknown entry 'arm'; expected some of hand, turn, apart, hands, hands_turn, base",
        ),
        ('[hand]\nlever = "ee.vx"', "[hand]: unknown entry 'lever'; expected some of a, b, back"),
        ('[hand]\na = "base.vx"', "[hand] a: expected one of ee.vx"),
        ('[actions]\na = "jump"', "[actions] a: expected one of hold, clutch"),
        ("[hand]\na = 3", "got 3"),
        ("hand = 3", "[hand]: expected a table, got 3"),
        ("[hand", "not valid TOML"),
    ],
)
def test_a_wrong_table_is_refused_in_one_line_that_names_the_choices(tmp_path, text, said):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(HandrailError, match=re.escape(said)) as error:
        load_map("gamepad", gamepad.CONTROLS, str(path))
    assert str(path) in str(error.value)
