"""Laws: whoever attacks the cockpit of a recording moves nothing, ends nothing and slows no loop."""

import json
import subprocess
import sys
import threading
import time
from contextlib import closing, suppress
from pathlib import Path

import cockpit_attacks
import numpy as np
import pytest
from cockpit_helpers import ask, drive, page
from page_recording import Recording, family
from websockets.exceptions import ConnectionClosed

from handrail.datasets.reading.reader import read_episodes, read_frames

pytestmark = pytest.mark.slow
ROUNDS = 2  # the first one shows how much room the server takes, the second that it takes no more
MOST_GROWTH = 20.0  # from one round to the next [MB]


def memory(process):
    """Return how much memory a process holds [MB]; 0 once it has ended."""
    status = Path(f"/proc/{process}/status")
    lines = status.read_text().splitlines() if status.exists() else []
    return sum(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmRSS"))


class Owner:
    """Drives with no deflection, all the time."""

    def __init__(self, recording):
        token = recording.address.split("#")[1]
        self.cookie = ask(recording, "/login", token.encode())[1]["set-cookie"].split(";")[0]
        self.frame, self.phases, self._ends = {}, [], False
        connection = page(recording, "the-owners-page", cookie=self.cookie)
        self._thread = threading.Thread(target=self._drive, args=(connection,))
        self._thread.start()

    def _drive(self, connection):
        sequence = 0
        with connection as socket, suppress(ConnectionClosed):  # the recording has ended
            self._socket = socket
            while not self._ends:
                try:
                    said = socket.recv(timeout=0.02)
                except TimeoutError:
                    said = "{}"
                frame = json.loads(said).get("frame") if isinstance(said, str) else None
                if frame:
                    self.frame = frame
                    self.phases.append(frame["phase"])
                if self.frame:
                    sequence += 1
                    socket.send(drive(sequence, self.frame["stamp"]))

    def until(self, phase):
        end = time.monotonic() + 200.0
        while self.frame.get("phase") != phase:
            assert time.monotonic() < end
            assert self._thread.is_alive()
            time.sleep(0.05)

    def ask(self, what):
        self._socket.send(json.dumps({"kind": "ask", "what": what, "value": True}))

    def close(self):
        self._ends = True
        self._thread.join()


def memories(recording):
    """Return what recording and web server hold [MB]."""
    return {
        "server" if "cockpit.server" in words else "recording": memory(pid)
        for pid, words in family(recording.process.pid).items()
    }


@pytest.fixture
def recording(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    flags = ("--task", "reach", "--mode", "direct", "--time_limit", 3000, "--dataset.num_episodes", 1)
    with closing(Recording(tmp_path, *flags, "--cockpit.host", "127.0.0.2")) as made:
        yield made


def check(said):
    """Nobody came in who may not, nothing broke."""
    assert said["no token"].startswith("HTTP/1.1 403")
    assert said["wrong tokens let in"] == 0
    assert said["the owner after that"].startswith("HTTP/1.1 200")
    assert not any(said[who] for who in ("foreign origin", "another's session", "no session"))
    assert said["a name made to point here"].startswith("HTTP/1.1 403")
    assert not said["a long body"].startswith("HTTP/1.1 2")
    assert not said["a long head"].startswith("HTTP/1.1 2")
    assert said["paths found"] == said["paths that broke it"] == 0
    assert said["messages"] >= cockpit_attacks.MESSAGES
    assert said["connections"] == cockpit_attacks.CONNECTIONS
    assert said["the page after all that"].startswith("HTTP/1.1 200")


def test_attacks_from_another_address(recording):
    owner = Owner(recording)
    try:
        owner.until("ready")
        owner.ask("start")
        owner.until("driving")
        time.sleep(5.0)
        began = time.time()
        start, held = len(owner.phases), [memories(recording)]
        for _ in range(ROUNDS):
            attack = [sys.executable, cockpit_attacks.__file__, recording.address, owner.cookie]
            said = json.loads(subprocess.run(attack, capture_output=True, check=True, text=True).stdout)
            check(said)
            held.append(memories(recording))
            print(said, held[-1], owner.frame["dropped"])
        assert set(owner.phases[start:]) <= {"driving", "lost"}  # a busy machine may make the owner late
        assert all(held[-1][name] - held[1][name] < MOST_GROWTH for name in held[0])
        owner.ask("success")
        assert recording.process.wait(120) == 0
    finally:
        owner.close()
    (row,) = read_episodes(recording.root)
    frames = read_frames(recording.root, 0, ["wall_clock", "action", "teleop.raw"])
    periods = np.diff(frames["wall_clock"])
    jitter = 1e3 * np.percentile(np.abs(periods - 0.05), [50, 95, 99])
    print(f"{row['late']} late of {len(periods)}, jitter p50 p95 p99 {jitter.round(1)} ms")
    assert not frames["action"][:, :-1].any()
    assert not frames["teleop.raw"].any()
    quiet = frames["wall_clock"][1:] < began - row["started"]
    assert np.median(periods[~quiet]) < 2.0 * np.median(periods[quiet])
    log = recording.log.read_text()
    assert "dropped or refused by the page's server" in log
    assert "Traceback" not in log
    assert owner.cookie.split("=")[1] not in log
    assert not list(Path(recording.root).rglob("*.key.pem"))
