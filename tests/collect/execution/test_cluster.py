"""On a Ray cluster of two computers, both here, jobs give what they give anywhere, also when one is lost."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from canned import canned
from command_helpers import ran, refused
from datasets_helpers import tree
from places import ROOT
from ray_helpers import record_with_a_loss
from shared_helpers import content, saved, started, wait_until

from handrail.datasets.reading.digest import digest_of_dataset

pytest.importorskip("ray.cluster_utils", reason="needs Ray: pip install '.[cluster]'")
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]
EPISODES, ROBOTS = 40, ROOT / "controllers" / "robot" / "robots"
FLAGS = ["--task", "reach", "--time_limit", "1.0", "--seed", "3"]


def record(root):
    ran(root, *FLAGS, "--dataset.num_episodes", EPISODES)


@pytest.fixture(scope="module")
def alone():
    """What one core records."""
    return content(canned(record))


def test_a_computer_that_is_lost_in_the_middle_costs_no_episode_and_makes_none_twice(
    cluster, alone, tmp_path
):
    loss = record_with_a_loss(cluster, tmp_path / "d", EPISODES, *FLAGS)
    assert EPISODES // 3 <= loss.kept < EPISODES
    assert loss.twice == 0
    assert content(tmp_path / "d") == alone
    assert len(set(started(tmp_path / "d"))) == EPISODES
    assert sorted(os.listdir(tmp_path)) == ["d"]


def test_an_interrupt_ends_all_at_once_and_one_core_goes_on(cluster, alone, tmp_path):
    root, shards = tmp_path / "d", tmp_path / ".d.shards"
    words = [sys.executable, "-m", "handrail.scripts", "record", str(root), *FLAGS, "--ray", cluster.address]
    process = subprocess.Popen(
        [*words, "--dataset.num_episodes", str(EPISODES)],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    )
    wait_until(lambda: len(saved(shards)) >= EPISODES // 4 or process.poll() is not None)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=120)
    assert process.returncode == 130, said
    assert "interrupted; the recording is kept in" in said
    assert "Traceback" not in said
    kept = {path: path.read_bytes() for path in saved(shards)}
    assert EPISODES // 4 <= len(kept) < EPISODES
    time.sleep(3.0)  # what would still record would be heard of by now
    assert {path: path.read_bytes() for path in saved(shards)} == kept
    times = {each for path in kept for each in started(path.parents[3])}
    record(root)
    assert content(root) == alone
    assert times <= set(started(root))


def test_the_same_rows_from_one_two_and_three_workers_and_from_the_cluster(cluster, tmp_path):
    places = *(("--workers", count) for count in (1, 2, 3)), ("--ray", cluster.address)
    for number, where in enumerate(places):
        ran(tmp_path / str(number), *FLAGS, "--dataset.num_episodes", 12, *where)
    assert len({digest_of_dataset(tmp_path / str(number)) for number in range(len(places))}) == 1


def test_a_relative_path_is_the_command_s(cluster, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (ROBOTS / "ridgeback_ur10.toml").read_text()
    Path("mine.toml").write_text(text.replace('\nname = "ridgeback_ur10"', '\nname = "mine"'))
    ran("set", *FLAGS, "--robot", "mine.toml", "--dataset.num_episodes", 1, "--ray", cluster.address)


def test_no_cluster_is_one_line(tmp_path):
    told = "--ray 127.0.0.1:1: expected a running cluster (`ray start --head`)"
    refused(tmp_path / "d", *FLAGS, "--dataset.num_episodes", 1, "--ray", "127.0.0.1:1", told=told)
    assert not (tmp_path / "d").exists()


@pytest.mark.needs_gl
def test_pictures_are_drawn_on_a_cluster_to_the_same_bytes(cluster, tmp_path):
    for name, where in (("here", ("--workers", 1)), ("there", ("--ray", cluster.address))):
        look = ("--output", tmp_path / name, "--cameras", "wrist", "--image_size", "32")
        ran(canned(record), *look, *where, name="edit render")
    assert tree(tmp_path / "there") == tree(tmp_path / "here")
    assert sorted(os.listdir(tmp_path)) == ["here", "there"]
