"""Laws of a terminal's keys: bytes in pieces, keys that repeat or go up, a terminal that is left or hangs."""

import numpy as np
import pytest
from device_players import PlayedTerminal, recorded
from hypothesis import given
from hypothesis import strategies as st

from handrail.collect.devices.key_bytes import NAMES, Key, KeyBytes
from handrail.collect.devices.keyboard import Keyboard

LONG_AGO = 1e9  # [s]


@pytest.fixture
def terminal():
    return PlayedTerminal()


@pytest.fixture
def keys(terminal, clock):
    made = Keyboard(terminal, clock)
    made.open()
    return made


def play(keys, terminal, clock, name, step=0.01, more=1.0):
    """Return the readings of every hundredth of a second, by the time since the first."""
    events, start, readings = recorded(name), clock.now, {}
    for index in range(round((events[-1]["time"] + more) / step)):
        now = round(index * step, 3)
        clock.now = start + now
        while events and events[0]["time"] <= now + 1e-9:
            terminal.bytes.append(events.pop(0)["bytes"].encode())
        reading = keys.read()
        while terminal.bytes:
            reading = keys.read()
        readings[now] = reading
    return readings


def held(readings, key):
    """Return from when to when a key was held, as pairs of times, to 0.1 s."""
    spans, before = [], False
    for time, reading in readings.items():
        if (key in reading.deflections) and not before:
            spans.append([time, time])
        elif key in reading.deflections:
            spans[-1][1] = time
        before = key in reading.deflections
    return np.round(spans, 1).tolist()


def pressed(readings):
    return [(time, key) for time, reading in readings.items() for key in reading.presses]


def test_a_plain_terminal(keys, terminal, clock):
    readings = play(keys, terminal, clock, "terminal_xterm.json")
    assert held(readings, "w") == [[0.3, 0.5], [0.8, 1.1], [3.4, 3.6]]  # until 0.2 s after its last character
    assert pressed(readings) == [
        (0.3, "w"),  # and what the terminal repeats is not pressed again
        (1.31, "right"),
        (1.5, "left"),
        (1.7, "down"),
        (1.7, "backspace"),
        (1.96, "escape"),  # once nothing has followed
        (2.2, "enter"),
        (2.4, "tab"),
        (2.6, "space"),
        (3.4, "w"),
        (3.6, "space"),  # of what is pasted the stop counts: it could as well have been typed
        (3.6, "space"),
    ]
    assert not readings[3.1].attended  # another window has the focus
    assert readings[3.2].attended
    assert not terminal.tells_releases
    assert not terminal.written


def test_a_terminal_that_tells_releases(keys, terminal, clock):
    readings = play(keys, terminal, clock, "terminal_kitty.json")
    assert terminal.tells_releases
    assert held(readings, "w") == [[0.3, 0.7]]
    assert held(readings, "r") == [[0.6, 0.8]]  # two at once
    assert pressed(readings) == [(0.3, "w"), (0.55, "r"), (0.9, "right"), (1.1, "escape")]
    assert all(reading.attended for reading in readings.values())
    assert b"\x1b[5n" in terminal.written


def test_a_terminal_that_hangs_is_no_key_that_is_held(keys, terminal, clock):
    terminal.bytes = [b"\x1b[?0u", b"\x1b[119u"]
    keys.read()
    assert keys.read().attended
    for _ in range(3):  # it answers
        clock.now += 0.06
        keys.read()
        clock.now += 0.02
        terminal.bytes = [b"\x1b[0n"]
        answered = keys.read()
        assert answered.attended
        assert answered.round_trip == pytest.approx(0.08)  # since it was asked
    heard = clock.now
    for _ in range(20):
        clock.now += 0.01
        reading = keys.read()
    assert reading.deflections == {"w": 1.0}
    assert not reading.attended
    assert reading.time == heard


@pytest.mark.parametrize("tells", [b"", b"\x1b[?0u"])
def test_while_a_policy_drives_a_terminal_says_all_the_time_that_it_is_there(terminal, clock, tells):
    """Nothing is held, and a connection that hangs is nobody; what comes again is somebody."""
    keys = Keyboard(terminal, clock, supervises=True)
    keys.open()
    terminal.bytes = [tells]
    for _ in range(100):
        clock.now += 0.01
        if terminal.written.count(b"\x1b[5n"):
            terminal.bytes.append(b"\x1b[0n")
            terminal.written = b""
        assert keys.read().attended
    keys.read()
    heard = clock.now
    for _ in range(21):
        clock.now += 0.01
        reading = keys.read()
    assert (reading.attended, reading.deflections) == (False, {})
    assert reading.time <= heard
    assert terminal.written.count(b"\x1b[5n") == 1, "a link that hangs is not filled"
    terminal.bytes = [b"\x1b[0n"]
    assert keys.read().attended


def test_a_computer_that_was_busy_is_no_terminal_that_hangs(terminal, clock):
    keys = Keyboard(terminal, clock, supervises=True)
    keys.open()
    for _ in range(3):
        clock.now += 10.0
        terminal.bytes = [b"", b"\x1b[0n"]
        assert keys.read().attended
        assert keys.read().attended


def test_leaving_the_window_lets_everything_go(keys, terminal, clock):
    terminal.bytes = [b"\x1b[?0u", b"\x1b[119u", b"\x1b[O", b"\x1b[I"]
    for wanted in ({}, {"w": 1.0}, {}, {}):
        assert keys.read().deflections == wanted


def test_ctrl_c_interrupts_where_the_terminal_does_not_do_it_itself(keys, terminal, monkeypatch):
    interrupts = []
    monkeypatch.setattr("_thread.interrupt_main", lambda: interrupts.append(1))
    terminal.bytes = [b"\x1b[?0u", b"\x1b[99;5u", b"\x1b[99;5:3u", b"\x1b[99;1u"]
    for _ in range(4):
        keys.read()
    assert interrupts == [1]


def all_keys(pieces):
    taken, found = KeyBytes(), []
    for index, piece in enumerate(pieces):
        found += taken.take(piece, 1e-3 * index)
    return found + taken.take(b"", LONG_AGO)


@given(
    st.lists(
        st.sampled_from([b"w", b"\x1b[A", b"\x1bOC", b"\x1b[119;1:3u", b"\x1b[I", b"\r", b"\x1b[27;1:1u"]),
        max_size=6,
    ),
    st.data(),
)
def test_keys_do_not_depend_on_where_the_bytes_are_split(parts, data):
    whole = b"".join(parts)
    cuts = sorted(data.draw(st.sets(st.integers(1, max(1, len(whole) - 1)))))
    pieces = [whole[a:b] for a, b in zip([0, *cuts], [*cuts, len(whole)], strict=True)]
    assert all_keys(pieces) == all_keys([whole])


@given(st.lists(st.binary(max_size=80), max_size=5))
def test_garbage_is_some_keys_or_none_and_never_an_error(pieces):
    assert all(key.name in NAMES | SIGNALS for key in all_keys(pieces))


def test_pasted_text_is_not_typed():
    taken = KeyBytes()
    assert taken.take(b"wwwwwwwwwwwwwwwww", 0.0) == []
    assert taken.take(b"w", 1.0) == [Key("w")]


SIGNALS = {"focus_in", "focus_out", "tells_releases", "there", "interrupt"}
BURSTS = {  # after a link has stalled, all comes at once
    "while a key is held": b"wwwwwwww ",
    "again and again": b" " * 9,
    "in what is pasted": b"rm -rf everything\r",
    "after Escape": b"\x1b ",
    "with Control": b"\x00",
    "with Option on a Mac": "\xa0".encode(),
    "with Shift on a French keyboard": "\u202f".encode(),
    "after a sequence that broke off": b"\x1b[ ",
    "in the midst of one": b"\x1b[1;2 w",
    "after another": b"\x1bO ",
    "with Control, as kitty says it": b"\x1b[32;5u",
    "with Alt, as kitty says it": b"\x1b[32;3u",
}


@pytest.mark.parametrize("burst", BURSTS)
def test_no_rule_keeps_back_the_stop(terminal, clock, burst):
    keys = Keyboard(terminal, clock)
    keys.open()
    terminal.bytes = [BURSTS[burst]]
    assert "space" in keys.read().presses


def test_a_stop_on_another_key_is_not_kept_back_either(terminal, clock):
    keys = Keyboard(terminal, clock, stops={"b"})
    keys.open()
    for burst in (b"wwwwwwwwb", b"\x1bb", b"\x1b[98;5u"):
        terminal.bytes = [burst]
        assert keys.read().presses == ("b",)
    terminal.bytes = [b"wwwwwwww ", b"\x1b "]
    assert [keys.read().presses, keys.read().presses] == [(), ()]


@pytest.mark.parametrize(
    ("typed", "wanted"),
    [
        ([(0.0, " "), (0.4, " "), (0.6, "\r"), (1.05, " ")], [" ", " ", "\r", " "]),  # never a repetition
        ([(0.0, "p"), (0.3, "\r"), (0.6, "p")], ["p", "\r", "p"]),  # another one came between
        ([(0.0, "y"), (0.3, "y"), (0.6, "y"), (1.4, "y")], ["y", "y"]),
    ],
)
def test_a_plain_terminal_repeats_the_last_key(keys, terminal, clock, typed, wanted):
    start, seen = clock.now, []
    for time, character in typed:
        clock.now = start + time
        terminal.bytes = [character.encode()]
        seen += keys.read().presses
    assert seen == [{" ": "space", "\r": "enter"}.get(each, each) for each in wanted]
