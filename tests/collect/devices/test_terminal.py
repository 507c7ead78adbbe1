"""Laws of the terminal: taken key by key, nothing echoed, put back; one line where there is none."""

import os
import pty
import select
import subprocess
import sys
import termios
import time

import pytest
from terminal_player import own_terminal

from handrail.collect.devices.keyboard import KeyTerminal, has_terminal
from handrail.controllers.errors import HandrailError

pytest.importorskip("termios", reason="only Linux and macOS have such terminals")

TAKE = """
import sys
from handrail.collect.devices.keyboard import KeyTerminal, has_terminal
terminal = KeyTerminal()
assert has_terminal()
terminal.open()
print("open", flush=True)
got = b""
while not got.endswith(b"q"):
    got += terminal.read(0.1)
terminal.tell_releases()
terminal.close()
print("got", got, flush=True)
sys.stdin.readline()
"""


def until(master, words, patience=20.0):
    """Return what a terminal showed until it said some words."""
    said, end = b"", time.monotonic() + patience
    while words not in said and time.monotonic() < end:
        ready, _, _ = select.select([master], [], [], 1.0)
        said += os.read(master, 4096) if ready else b""
    assert words in said, said
    return said


def test_keys_come_at_once_and_the_terminal_is_put_back():
    master, slave = pty.openpty()
    before = termios.tcgetattr(slave)
    child = subprocess.Popen(
        [sys.executable, "-c", TAKE], stdin=slave, stdout=slave, stderr=slave, preexec_fn=own_terminal
    )
    try:
        said = until(master, b"open")
        taken = termios.tcgetattr(slave)
        assert not taken[3] & (termios.ECHO | termios.ICANON)
        assert taken[3] & termios.ISIG  # Ctrl-C still interrupts
        os.write(master, b"\x13wq")
        said += until(master, b"got b'\\x13wq'")
        assert termios.tcgetattr(slave) == before
        assert b"\x1b[>11u" in said
        assert b"\x1b[<u" in said
        assert said.count(b"\x1b[?1004h") == said.count(b"\x1b[?1004l") == 1
        os.write(master, b"\n")
        assert child.wait(20) == 0
    finally:
        child.kill()
        child.wait()
        os.close(master)
        os.close(slave)


def test_without_a_terminal_it_says_what_to_do(monkeypatch):
    with open(os.devnull) as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        assert not has_terminal()
        with pytest.raises(HandrailError, match=r"expected a terminal to read keys from, found none; .*brow"):
            KeyTerminal().open()


def test_the_answer_of_a_terminal_that_is_let_go_at_once_is_not_typed_into_the_shell():
    code = "from handrail.collect.devices.keyboard import KeyTerminal as K; k = K(); k.open(); k.close()"
    code += "; import time; time.sleep(0.5); print('left', flush=True)"
    master, slave = pty.openpty()
    words = [sys.executable, "-c", code]
    with subprocess.Popen(words, stdin=slave, stdout=slave, stderr=slave, preexec_fn=own_terminal):
        said = until(master, b"\x1b[c")
        time.sleep(0.02)
        os.write(master, b"\x1b[?62;22c")
        said += until(master, b"left")
    os.close(master)
    os.close(slave)
    assert b"62;22c" not in said  # echoed
