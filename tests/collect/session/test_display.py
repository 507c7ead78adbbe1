"""The display's laws: refused before anything is written, for this machine alone, never in the way."""

import os
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest
from collect_helpers import episode
from command_helpers import command

from handrail.collect.session import viewer
from handrail.collect.session.display import Display, Drawing
from handrail.datasets.reading.reader import read_info

pytest.importorskip("rerun")
SCREENS = ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")
REACH = ("--task", "reach", "--dataset.num_episodes", "1")


def listening() -> dict[int, str]:
    """Return every port that somebody listens on and its address, as the kernel writes it."""
    lines = [
        line.split()
        for name in ("tcp", "tcp6")
        for line in Path(f"/proc/net/{name}").read_text().splitlines()
    ]
    return {int(w[1].split(":")[1], 16): w[1].split(":")[0] for w in lines if w[3] == "0A"}


def ports(address: str) -> list[int]:
    return [int(port) for port in re.findall(r"127\.0\.0\.1(?::|%3A)(\d+)", address)]


@pytest.mark.parametrize("screen", ["", ":4711"])
def test_without_a_screen_the_viewer_is_refused_at_once(screen, tmp_path, monkeypatch):
    """Where somebody may be asked for a screen, in a process of its own: what hangs there fails here."""
    words = [*REACH, "--display_data", str(tmp_path / "set")]
    for name in SCREENS:
        monkeypatch.delenv(name, raising=False)
    if screen:
        monkeypatch.setenv("DISPLAY", screen)
        program = [sys.executable, "-m", "handrail.scripts", "record", *words]
        done = subprocess.run(program, capture_output=True, text=True, timeout=120)
    else:
        done = command(*words)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert {"--display_data:", "--display_web", "--display_save"} <= set(done.stderr.split())
    assert not (tmp_path / "set").exists()


def test_the_web_viewer_is_for_this_machine_alone_and_ends_with_the_recording(tmp_path):
    said = []
    display = Display(web=True, save=str(tmp_path / "seen.rrd"), say=said.append)
    try:
        address = said[0].split()[-1]
        there = listening()
        assert [there[port] for port in ports(address)] == ["0100007F"] * 2
        with urllib.request.urlopen(address, timeout=10) as page:
            assert b"Rerun" in page.read()
    finally:
        display.close()
    assert not set(ports(address)) & set(listening())
    assert (tmp_path / "seen.rrd").stat().st_size > 0


@pytest.mark.parametrize("trouble", [signal.SIGKILL, signal.SIGSTOP])
def test_a_viewer_that_dies_or_stalls_never_stops_a_recording(trouble, tmp_path, monkeypatch):
    monkeypatch.setattr(viewer, "MOST_WAITING", 2**17)
    honest, sent = viewer.Viewer.send, []

    def troubled(self, data):
        sent.append(data)
        if len(sent) == 4:
            os.kill(self.process.pid, trouble)
            if trouble == signal.SIGKILL:
                self.process.wait()
        honest(self, data * (1 if len(sent) < 4 else 40))

    monkeypatch.setattr(viewer.Viewer, "send", troubled)
    draw, drawn = Drawing.see, []
    monkeypatch.setattr(Drawing, "see", lambda self, frame: (drawn.append(frame), draw(self, frame)))
    monkeypatch.setenv("HOME", str(tmp_path))
    saved = tmp_path / "seen.rrd"
    done = command(*REACH, "--display_web", "--display_save=~/seen.rrd", tmp_path / "set")
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("the recording goes on") == 1
    info = read_info(tmp_path / "set")
    assert info.episodes == 1
    assert len(drawn) == info.frames  # the file has the rest too
    assert saved.stat().st_size > 2**17


def test_an_error_in_drawing_is_said_once(monkeypatch):
    said = []
    display = Display(say=said.append)
    monkeypatch.setattr(Drawing, "see", lambda self, frame: 1 / 0)
    episode(2, display, task="reach", time_limit=1.0)
    display.close()
    assert said == ["display: division by zero; the recording goes on"]
