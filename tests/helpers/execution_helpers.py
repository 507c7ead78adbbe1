"""Jobs for the tests of what runs jobs, as other processes find them: by module and name."""

import os
import signal
import sys
import time
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_info

from handrail.controllers.errors import HandrailError


def squared(number):
    return number * number


def threads():
    """Return the most threads that a library of this process uses, and which process it is."""
    np.dot(np.ones((8, 8)), np.ones((8, 8)))
    return max(library["num_threads"] for library in threadpool_info()), os.getpid()


def noted(folder, name, value=0):
    """Leave a file a run, and return a value."""
    folder = Path(folder)
    (folder / f"{name}.{len(list(folder.glob(f'{name}.*')))}").touch()
    return value


def dying(folder, name, times, value=0):
    """Die, as for want of memory, the first times that this is done; then return a value."""
    noted(folder, name)
    if len(list(Path(folder).glob(f"{name}.*"))) <= times:
        os.kill(os.getpid(), signal.SIGKILL)
    return value


def refusing(words):
    print("about to fail")
    raise HandrailError(words)


def broken():
    raise RuntimeError("a mistake of ours")


def leaving():
    sys.exit("enough")


def sleeping(folder, name, seconds=600.0):
    """Say which process this is, then do nothing for long."""
    (Path(folder) / f"{name}.pid").write_text(str(os.getpid()))
    time.sleep(seconds)


def is_alive(process):
    """Return whether a process is there and no zombie."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"
