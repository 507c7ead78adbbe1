"""Runs `handrail-cockpit` for a test, and reads what it saved."""

import contextlib
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pyarrow.parquet as pq
from page_driver import PageDriver

from handrail.controllers.robot.model import load_model
from handrail.datasets.reading.reader import read_episodes, read_info

_PERIOD = 0.05  # of a frame [s]


def family(process):
    """Return a process and its descendants, with their command lines."""
    found = {}
    with contextlib.suppress(psutil.Error):
        first = psutil.Process(process)
        for each in (first, *first.children(recursive=True)):
            with contextlib.suppress(psutil.Error):
                found[each.pid] = "\0".join(each.cmdline())
    return found


def command(*words):
    program = [sys.executable, "-m", "handrail.scripts", *map(str, words)]
    return [*program, "--cockpit.no_open", "--cockpit.port", "0"]


class Recording:
    """`handrail-cockpit` that goes on beside a test and says what it says to a file."""

    def __init__(self, folder, *flags):
        self.root, self.log = folder / "dataset", folder / "log"
        with self.log.open("w") as log:
            self.process = subprocess.Popen(command("cockpit", self.root, *flags), stderr=log)
        while "Drive at" not in self.log.read_text():
            assert self.process.poll() is None, self.log.read_text()
            time.sleep(0.1)
        self.address = self.log.read_text().split("Drive at ")[1].split()[0]

    @property
    def server(self):
        """The process of the web server."""
        (found,) = [pid for pid, words in family(self.process.pid).items() if "cockpit.server" in words]
        return found

    def close(self):
        if self.process.poll() is None:
            self.process.terminate()
        self.process.wait(60)


@contextlib.contextmanager
def started(*words, cwd=None):
    """Run a command that opens a cockpit; give its process, its address and what it said before."""
    process = subprocess.Popen(command(*words), stderr=subprocess.PIPE, text=True, cwd=cwd)
    try:
        said = []
        while "Drive at" not in (line := process.stderr.readline()):
            said.append(line)
            assert line, "".join(said)
        yield process, line.split("Drive at ")[1].strip(), "".join(said)
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
        with contextlib.suppress(ValueError):  # a test has read it all
            process.communicate(timeout=60)


@contextlib.contextmanager
def recording(folder, *flags, cwd=None):
    """Run `handrail-cockpit` for a folder, or with none; give its process and address."""
    with started("cockpit", *([folder] if folder else []), *flags, cwd=cwd) as (process, address, _):
        yield process, address


@contextlib.contextmanager
def driven(new_page, folder, *flags):
    """Run `handrail-cockpit` and begin an episode on its page; what is done there ends the recording well."""
    with recording(folder, *flags) as (process, address):
        driver = PageDriver(new_page(), address)
        driver.begin()
        yield driver
        assert process.wait(90) == 0


def saved(folder):
    """Return the columns of the data that was saved, by episode."""
    files = sorted((Path(folder) / "data").rglob("*.parquet"))
    return [pq.read_table(file).to_pydict() for file in files]


def rows(folder):
    """Return what the dataset says of each episode that was saved."""
    return read_episodes(Path(folder))


def is_smooth(frames):
    """Whether consecutive commands, from rest on, are within what the robot may accelerate."""
    sent, limits = np.array(frames["action"])[:, :-1], load_model().description.limits
    return bool(np.all(np.abs(np.diff(sent, axis=0, prepend=0.0)) <= _PERIOD * limits.acceleration * 1.00001))


def is_whole(frames):
    """Whether no frame is missing."""
    return frames["frame_index"] == list(range(len(frames["action"])))


def hand_columns(folder):
    """Return where the hand is in the observed state."""
    names = read_info(folder).features["observation.state"].names
    return [names.index(f"tool.{axis}") for axis in "xyz"]
