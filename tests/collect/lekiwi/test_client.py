"""handrail-record drives a LeKiwi through LeRobot's client: here one in this process, in its own time."""

import logging
import math
from typing import Any
from unittest import mock

import numpy as np
import pyarrow.parquet as pq
import pytest
from command_helpers import command, refused
from lekiwi_helpers import ZERO, FarClient, PlayedClient, interrupted_drive, rude_drive

from handrail.collect.client_config import ClientConfig
from handrail.collect.commands.replay import replay_episode
from handrail.collect.commands.tables import summary_table
from handrail.collect.lekiwi import client_plant
from handrail.collect.lekiwi.client_plant import ClientPlant
from handrail.collect.lekiwi.link import Link, connect
from handrail.collect.world.scene import Scene, Viewpoint
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.threads import single_threaded
from handrail.controllers.robot.model import load_model
from handrail.datasets.reading.reader import read_episodes

FLAGS = ("--robot", "lekiwi", "--robot_client", "lekiwi", "--task", "reach", "--client.simulated")


def link(client: PlayedClient, robot: str = "lekiwi", simulated: bool = True) -> Link:
    return Link(client, "lekiwi", load_model(robot), 0.05, simulated, client.clock, client.sleep)


def recorded(client: PlayedClient, folder, *flags):
    """Run handrail-record against a client."""

    def connect(*_) -> Link:
        return link(client)

    with mock.patch.object(client_plant, "connect", connect):
        return command(folder, *FLAGS, *flags)


def column(folder, name: str) -> list:
    files = sorted((folder / "data").rglob("*.parquet"))
    return [value for file in files for value in pq.read_table(file, columns=[name])[name].to_pylist()]


def test_an_episode_through_the_client_reaches_its_goal(tmp_path):
    client = PlayedClient()
    done = recorded(client, tmp_path / "set", "--dataset.num_episodes", 2)
    assert done.returncode == 0, done.stderr
    assert "2/2 succeeded" in done.stderr
    assert set(column(tmp_path / "set", "controller.status")) == {"ok"}
    assert not math.isnan(client.body.done_at)  # the goal was reached in truth, not by odometry alone
    assert client.body.contacts == 0
    assert all(client.sent[-1][name] == 0.0 for name in ZERO)
    assert not client.connected
    robots = {row["robot_client"] for row in read_episodes(tmp_path / "set")}
    assert robots == {"lekiwi (simulated)"}
    assert "driven through the client of lekiwi (simulated)" in summary_table(tmp_path / "set").caption
    assert replay_episode(tmp_path / "set", 1)[0].robot_client == "lekiwi (simulated)"


def test_a_robot_that_is_silent_for_a_moment_brakes_and_one_that_stays_so_ends_the_recording(tmp_path):
    moment = PlayedClient(silent=(2.5, 3.2))
    done = recorded(moment, tmp_path / "moment", "--dataset.num_episodes", 1)
    assert done.returncode == 0, done.stderr
    assert "invalid_state" in column(tmp_path / "moment", "controller.status")
    gone = PlayedClient(silent=(2.5, math.inf))
    done = recorded(gone, tmp_path / "gone", "--dataset.num_episodes", 3)
    assert done.returncode == 1
    assert "nothing usable heard for 2 s" in done.stderr
    assert all(gone.sent[-1][name] == 0.0 for name in ZERO)


def test_the_base_frame_is_where_the_task_has_put_it_wherever_the_robot_stands():
    client, q = PlayedClient(), np.array([0.3, -0.2, 1.0, *load_model("lekiwi").description.home[3:]])
    plant = ClientPlant(load_model("lekiwi"), Scene((), Viewpoint((0, 0, 1), (0, 0, 0))), q, link(client), 3)
    assert plant.state().q == pytest.approx(q, abs=0.05)
    assert plant.state().q[:3] == pytest.approx(q[:3], abs=1e-3)
    start = client.body.base
    for _ in range(40):
        plant.send([0.0, 0.1, 0.0, 0, 0, 0, 0, 0, 0])
    plant.stop()
    away = client.body.base - start
    c, s = math.cos(1.0 - start[2]), math.sin(1.0 - start[2])
    moved = plant.state().q[:2] - q[:2]
    assert moved == pytest.approx([0.0, 0.19], abs=0.02)
    assert [c * away[0] - s * away[1], s * away[0] + c * away[1]] == pytest.approx(moved, abs=0.01)
    with pytest.raises(HandrailError, match="cannot be put back"):
        plant.restore(plant.checkpoint())


def test_an_arm_that_does_not_come_home_is_named():
    client = PlayedClient()
    away = load_model("lekiwi").description.home + np.array([0, 0, 0, 0.5, 0, 0, 0, 0])
    client.stubborn = True
    with pytest.raises(HandrailError, match="joint shoulder_pan does not come to where the episode begins"):
        ClientPlant(load_model("lekiwi"), Scene((), Viewpoint((0, 0, 1), (0, 0, 0))), away, link(client), 0)


def test_another_robot_is_refused_at_once():
    with pytest.raises(HandrailError, match=r"got ridgeback_ur10 \(--robot lekiwi\?\)"):
        link(PlayedClient(), "ridgeback_ur10")


def test_pictures_have_our_names_size_and_colours_and_a_lost_camera_ends_it():
    picture = np.zeros((480, 640, 3), np.uint8)
    picture[..., 0] = 200  # red, as LeRobot's client has it
    one = link(PlayedClient(cameras={"front": picture}))
    seen = one.pictures(("front",), (64, 96))["front"]
    assert seen.shape == (64, 96, 3)
    assert seen[0, 0].tolist() == [200, 0, 0]
    with pytest.raises(HandrailError, match="camera wrist says nothing"):
        one.pictures(("wrist",), (64, 64))


def test_red_before_a_lekiwis_camera_is_red_in_the_dataset():
    """Its camera says RGB; its host codes that, and LeRobot's client decodes it, as if it were BGR."""
    import cv2
    from lerobot.cameras import ColorMode
    from lerobot.robots.lekiwi.config_lekiwi import lekiwi_cameras_config

    cameras: Any = lekiwi_cameras_config()
    assert {camera.color_mode for camera in cameras.values()} == {ColorMode.RGB}
    _, coded = cv2.imencode(".jpg", np.full((48, 64, 3), (200, 0, 0), np.uint8))
    said = cv2.imdecode(coded, cv2.IMREAD_COLOR)
    seen = link(PlayedClient(cameras={"front": said})).pictures(("front",), (48, 64))["front"]
    assert seen[24, 32].tolist() == pytest.approx([200, 0, 0], abs=5)


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (("--robot_client", "lawnmower"), "unknown --robot_client 'lawnmower': expected one of lekiwi"),
        (("--robot_client", "lekiwi", "--operator", "browser"), "expected another --operator"),
        (("--robot_client", "lekiwi", "--no_physics"), "expected none of"),
        (("--robot_client", "lekiwi"), "--operator scripted: expected a person, to stop the robot"),
        (("--client.simulated",), "expected --robot_client too"),
        (
            ("--robot_client", "lekiwi", "--client.port_zmq_cmd", "0"),
            "expected a whole number >= 1",
        ),
    ],
)
def test_wrong_flags_are_named(tmp_path, flags, words):
    refused(tmp_path / "set", "--task", "reach", *flags, told=words)
    assert not (tmp_path / "set").exists()


@pytest.mark.parametrize("seeds", [1, pytest.param(12, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("gap", "latency", "drop", "least"),
    [(0.25, 0, 0, 0.05), (0.45, 0, 0, 0.03), (1, 0, 0, 0.01), (0, 0.1, 0.1, 0.3)],
)
def test_delays_touch_nothing(gap, latency, drop, least, seeds):
    with single_threaded():
        found = [rude_drive(gap, latency, drop, seed, seconds=10.0) for seed in range(seeds)]
    assert not any(contacts for contacts, _ in found)
    assert found[0][1] > least  # a robot that never moves touches nothing, too [m]


def test_every_command_is_sent_twice_half_a_period_apart():
    client = PlayedClient()
    link = Link(client, "lekiwi", load_model("lekiwi"), 0.05, True, client.clock, client.sleep)
    times, send = [], client.send_action
    client.send_action = lambda action: (times.append(client.clock.now), send(action))[1]
    for speed in (0.01, 0.02):
        client.sent.clear()
        times.clear()
        link.exchange([speed, 0, 0, 0, 0, 0, 0, 0, 0])
        assert np.diff(times) == pytest.approx(0.025)
        assert len(client.sent) == 2
        assert client.sent[0] == client.sent[1]
        assert client.sent[0]["x.vel"] == pytest.approx(speed, abs=1e-3)
    link.close()


def test_a_base_whose_next_command_is_late_is_sent_the_stop_and_that_is_said(caplog):
    client = FarClient(0.0, 0.0, 0)
    link = client.link = Link(client, "lekiwi", load_model("lekiwi"), 0.05, False, client.clock, client.sleep)
    for _ in range(10):
        link.exchange([0.1, 0, 0, 0, 0, 0, 0, 0, 0])
    assert client.body.observation()["x.vel"] > 0.08
    client.sleep(0.45)  # less than the host's watchdog takes
    assert abs(client.body.observation()["x.vel"]) < 0.01
    with caplog.at_level(logging.WARNING):
        link.close()
    assert "commands were late" in caplog.text


def test_from_a_late_command_on_each_period_is_one_of_the_full_stop():
    """Law: it is late 1.5 periods after the one before; then the base brakes as fast as its limits say."""
    client = PlayedClient()
    far = link(client)
    for _ in range(20):
        far.exchange([0.2, 0, 0, 0, 0, 0, 0, 0, 0])
    speed, began = far.body.velocity[0], client.clock.now - far.period
    step = far.model.description.limits.acceleration[0] * far.period
    assert speed > 4 * step
    while far.body.velocity.any():
        client.sleep(0.5 * far.period + 1e-6)
        far.brake_if_late()
        periods = (client.clock.now - began) / far.period
        braked = np.floor(periods - 0.5)
        assert far.body.velocity[0] == pytest.approx(max(speed - step * braked, 0.0), abs=1e-6)
    assert periods < 2.5 + speed / step
    far.close()


@pytest.mark.parametrize("fps", [20, 30, 50])
def test_a_robot_that_says_nothing_new_does_not_make_the_next_command_late(fps):
    """LeRobot's client waits for news; an operator, the MPC and the recorder need a fifth of the period."""
    with mock.patch("handrail.collect.lekiwi.link.Link", lambda client, *_: client):
        made: Any = connect("lekiwi", ClientConfig("127.0.0.1"), (), load_model("lekiwi"), fps)
    client = FarClient(0.0, 0.0, 0)
    far = Link(client, "lekiwi", load_model("lekiwi"), 1 / fps, False, client.clock, client.sleep)
    client.link, say = far, client.get_observation
    client.get_observation = lambda: (client.sleep(made.polling_timeout_ms / 1000), say())[1]
    for _ in range(2 * fps):
        client.sleep(0.2 / fps)
        far.exchange([0.1, 0, 0, 0, 0, 0, 0, 0, 0])
    assert not far.late
    far.close()


def test_a_dataset_that_cannot_say_what_was_driven_is_refused_before_the_robot_moves(tmp_path):
    """Before, the first episode was driven to its end, and could not be saved."""
    simulated = ("--robot", "lekiwi", "--task", "reach", "--time_limit", "0.2", "--dataset.num_episodes", 1)
    assert command(tmp_path / "set", *simulated).returncode == 0
    client = PlayedClient()
    done = recorded(client, tmp_path / "set", "--resume", "--dataset.num_episodes", 1)
    assert done.returncode == 2, done.stderr
    assert "its episodes have no 'robot_client'" in done.stderr
    assert all(set(sent.values()) <= {0.0} for sent in client.sent)
    assert len(read_episodes(tmp_path / "set")) == 1


@pytest.mark.parametrize(("cut", "seconds", "ahead"), [("deaf", 0.6, 0.01), ("halted", 0.4, 0.03)])
def test_a_gap_in_hearing_a_robot_loses_none_of_its_way(cut, seconds, ahead):
    """It drives on, or is braked, while nobody hears it: expected is where that has led, or farther."""
    off, contacts = interrupted_drive(cut, seconds, seed=0)
    assert -0.005 < min(off) <= max(off) < ahead
    assert contacts == 0
