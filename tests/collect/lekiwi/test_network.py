"""LeRobot's own LeKiwiClient, unmodified, against the simulated host: two processes and a network."""

import importlib
import json
import runpy
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from command_helpers import command, refused
from places import ROOT
from shared_helpers import wait_until

pytest.importorskip("zmq", reason="pip install '.[lekiwi]'")
pytestmark = pytest.mark.slow  # each process imports everything, and an episode is in real time

PATIENCE = 120.0  # [s]
FLAGS = ("--robot", "lekiwi", "--robot_client", "lekiwi", "--task", "reach")
DRIVER = """
import sys, time
from lerobot.robots.lekiwi import LeKiwiClient, LeKiwiClientConfig
ports = map(int, sys.argv[1:])
client = LeKiwiClient(LeKiwiClientConfig("127.0.0.1", *ports, cameras={}, connect_timeout_s=60))
client.connect()
said = client.get_observation()
arm = {name: value for name, value in said.items() if name.endswith(".pos")}
while True:
    client.send_action({**arm, "x.vel": 0.1, "y.vel": 0.0, "theta.vel": 0.0})
    time.sleep(1 / 30)
    print(client.get_observation()["x.vel"], flush=True)
"""


def free_ports() -> tuple[int, int]:
    with socket.socket() as one, socket.socket() as other:
        one.bind(("127.0.0.1", 0))
        other.bind(("127.0.0.1", 0))
        return one.getsockname()[1], other.getsockname()[1]


class Host:
    """The command in a process of its own."""

    def __init__(self, folder: Path, *flags: str) -> None:
        self.ports, self.json = free_ports(), folder / "host.json"
        ports = ("--port_zmq_cmd", self.ports[0], "--port_zmq_observations", self.ports[1])
        words = ["-m", "handrail.scripts", "lekiwi", "host", *ports, "--json", self.json, *flags]
        self.process = subprocess.Popen([sys.executable, *map(str, words)], stdout=subprocess.PIPE, text=True)
        assert self.process.stdout
        assert "LeKiwi (simulated)" in self.process.stdout.readline()

    def end(self) -> dict:
        """End it; return what it saw."""
        self.process.terminate()
        self.process.communicate(timeout=PATIENCE)
        assert self.process.returncode == 130
        return json.loads(self.json.read_text())


@pytest.fixture
def host(tmp_path):
    made = Host(tmp_path)
    yield made
    made.process.kill()
    made.process.communicate()


def test_the_base_stops_when_its_client_is_killed(host):
    driver = subprocess.Popen(
        [sys.executable, "-c", DRIVER, *map(str, host.ports)], stdout=subprocess.PIPE, text=True
    )
    assert driver.stdout
    try:
        assert any(float(line) > 0.08 for line in driver.stdout)  # it drives
    finally:
        driver.kill()
        driver.communicate()
    time.sleep(2.0)  # the watchdog's half second, and braking
    seen = host.end()
    still = seen["episodes"][-1]["base"]
    assert seen["base_stops"] >= 1
    assert seen["base_speed"] < 1e-3
    assert still[0] > -0.45  # it has come along


@pytest.mark.needs_gl
def test_lerobot_s_client_sees_what_the_cameras_paint(tmp_path):
    """Two cameras of LeKiwi's own sizes, painted by the host, coded, sent and decoded."""
    from lerobot.robots.lekiwi import LeKiwiClient, LeKiwiClientConfig

    host, seen = Host(tmp_path, "--cameras", "front,wrist"), {}
    client = LeKiwiClient(LeKiwiClientConfig("127.0.0.1", *host.ports, connect_timeout_s=60))
    client.connect()

    def both():
        seen.update(client.get_observation())
        return seen["front"].any() and seen["wrist"].any()

    wait_until(both, PATIENCE)
    client.disconnect()
    host.end()
    assert (seen["front"].shape, seen["wrist"].shape) == ((480, 640, 3), (640, 480, 3))
    for name in ("front", "wrist"):
        assert seen[name].dtype == np.uint8
        assert seen[name].std() > 10.0, name  # something is to be seen


def test_an_episode_is_recorded_through_the_network(tmp_path, host):
    ports = ("--client.port_zmq_cmd", host.ports[0], "--client.port_zmq_observations", host.ports[1])
    done = command(tmp_path / "set", *FLAGS, "--client.simulated", *ports, "--dataset.num_episodes", 1)
    assert done.returncode == 0, done.stderr
    assert "1/1 succeeded" in done.stderr
    seen = host.end()
    assert seen["malformed"] == 0
    assert seen["episodes"][-1]["contacts"] == 0
    assert seen["episodes"][-1]["success_at"] is not None


def test_nobody_there_is_said_in_one_line(tmp_path):
    cmd, observations = free_ports()
    ports = ("--client.port_zmq_cmd", cmd, "--client.port_zmq_observations", observations)
    told = "--robot_client lekiwi: cannot be reached: Timeout waiting for LeKiwi Host"
    refused(tmp_path / "set", *FLAGS, "--client.simulated", *ports, told=told)


def test_lerobots_own_loop_records_through_the_processor(tmp_path, host, monkeypatch, capsys):
    importlib.import_module("played_leader")
    file = ROOT / "docs" / "examples" / "record_with_mpc.py"
    words = ["127.0.0.1", tmp_path / "set", "played_hand", *host.ports, 3.0]
    monkeypatch.setattr(sys, "argv", [str(file), *map(str, words)])
    runpy.run_path(str(file), run_name="__main__")
    assert "2 episodes" in capsys.readouterr().out
    files = sorted((tmp_path / "set" / "data").rglob("*.parquet"))
    rows = [row for file in files for row in pq.read_table(file, columns=["action"])["action"].to_pylist()]
    actions = np.array(rows)
    assert actions.shape[1] == 9
    assert np.ptp(actions, axis=0).max() > 1.0  # degrees: the arm takes part
    seen = host.end()
    assert seen["malformed"] == 0
    assert seen["episodes"][-1]["contacts"] == 0
    assert seen["episodes"][-1]["base"][0] > -0.44  # so does the base
