"""Ctrl-C and SIGTERM end every command with one line and 130, whenever they come, and leave no process."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from canned import canned, record_by_command

from handrail.scripts.bench.soak.child import session
from handrail.scripts.commands import COMMANDS

OURS, BENCH = ("-m", "handrail.scripts"), ("-m", "handrail.scripts.bench")
LIGHT = """
import signal, sys
sys.argv = ["handrail-x"]
import handrail.scripts
assert all(callable(signal.getsignal(number)) for number in (signal.SIGINT, signal.SIGTERM))
assert signal.getsignal(signal.SIGINT) is not signal.default_int_handler
print(*sys.modules)
"""
SET = ("--task", "reach", "--dataset.num_episodes")
WORK = {
    "record": (*OURS, "record", "OUT", *SET, "50"),
    "record with workers": (*OURS, "record", "OUT", *SET, "50", "--workers", "2"),
    "replay": (*OURS, "replay", "SET"),
    "compare": (*OURS, "compare", "SET", "SET", "--output", "OUT"),
    "train": (*OURS, "train", "SET", "--output", "OUT", "--steps", "100000", "--batch_size", "8"),
    "evaluate": (*OURS, "evaluate", "OUT/none"),
    "pack": (*OURS, "edit", "pack", "SET", "--output", "OUT"),
    "lekiwi": (*OURS, "lekiwi", "host"),
    "bench": (*BENCH, "goal_reaching"),
    "bench with workers": (*BENCH, "goal_reaching", "--workers", "2"),
}


def begun(*words: str, **options) -> subprocess.Popen:
    """Begin a command in a session of its own; return when it hears SIGTERM."""
    process = subprocess.Popen(
        [sys.executable, *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        **options,
    )
    while process.poll() is None and not hears(process.pid):
        time.sleep(0.001)
    return process


def hears(pid: int) -> bool:
    caught = re.search(r"SigCgt:\s*(\w+)", Path(f"/proc/{pid}/status").read_text())
    return caught is not None and bool(int(caught[1], 16) >> (signal.SIGTERM - 1) & 1)


def ended(process: subprocess.Popen, number: int, done: tuple[int, ...] = ()) -> str | None:
    """Send a signal; return what the command said, which left no process; None where it was done before."""
    process.send_signal(number)
    _, said = process.communicate(timeout=120)
    if process.returncode in done:
        return None
    assert process.returncode == 130, said
    assert said.endswith("interrupted\n") or "interrupted; " in said
    assert "Traceback" not in said
    deadline = time.monotonic() + 60
    while left := session(process.pid):
        assert time.monotonic() < deadline, left
        time.sleep(0.02)
    return said


def test_a_command_hears_before_it_imports_anything_heavy():
    done = subprocess.run([sys.executable, "-c", LIGHT], capture_output=True, text=True, check=True)
    loaded = {name.partition(".")[0] for name in done.stdout.split()}
    assert not loaded & {"numpy", "tyro", "rich", "gymnasium", "torch", "mujoco", "multiprocessing"}


def test_a_program_that_imports_a_command_keeps_its_signals():
    own = (signal.default_int_handler, signal.SIG_IGN)  # a shell's background job ignores it
    assert signal.getsignal(signal.SIGINT) in own
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("name", [name for name, command in COMMANDS.items() if "" in command.verbs])
def test_a_command_that_loads_is_ended_by_one_line(name, number):
    """At some moment of the first 0.05 s, long before it has imported what it needs."""
    process = begun(*OURS, name, "--help")
    time.sleep(np.random.default_rng(list(name.encode())).uniform(0.0, 0.05))
    assert ended(process, number) == "error: interrupted\n"


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [0.5, 1.0, 2.0, 4.0, 8.0])
@pytest.mark.parametrize("name", WORK)
def test_a_command_that_works_is_ended_by_one_line(name, seconds, tmp_path):
    """One that is done by then is tried again, twice as early; one that ignores signals is always done."""
    for moment in seconds * 0.5 ** np.arange(5):
        out = tmp_path / f"{moment}"
        places = {
            "SET": str(canned(record_by_command, f"{' '.join(SET)} 4")),
            "OUT": str(out),
            "OUT/none": str(out / "none"),
        }
        words = [places.get(word, word) for word in WORK[name]]
        process = begun(*words, cwd=tmp_path, env=os.environ | {"HF_HUB_OFFLINE": "1"})
        time.sleep(moment)
        if ended(process, signal.SIGTERM, done=(0, 2)):
            return
    pytest.fail("it never listened")
