"""A shared recording is the one-core recording, whoever records what, and whatever dies on the way."""

import os
import shutil
import signal
import subprocess
import sys
from errno import ENOSPC
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np
import pytest
from canned import canned
from command_helpers import command, refused
from execution_helpers import is_alive
from shared_helpers import content, pictures, saved, started, wait_until, workers_of

from handrail.collect.client_config import ClientConfig
from handrail.collect.commands.account import RecordingLog
from handrail.collect.commands.shared import Shards
from handrail.collect.config import DatasetConfig, RecordConfig
from handrail.datasets.format.layout import Layout
from handrail.datasets.reading.reader import read_info
from handrail.datasets.recording.repair import repair
from handrail.datasets.storage.lock import FolderLock

# a second each: most fail, which is no matter
FLAGS = ["--task", "reach", "--time_limit", "1.0", "--seed", "3"]
EPISODES = 15  # three shards


def record(root, *flags, episodes=EPISODES):
    done = command(root, *FLAGS, "--dataset.num_episodes", episodes, *flags)
    assert done.returncode == 0, done.stderr
    return done


@pytest.fixture(scope="module")
def alone():
    """What one core records."""
    return content(canned(record))


def plan(root, first):
    """Begin to share a recording, without anybody who records."""
    dataset = DatasetConfig(root=str(root), num_episodes=EPISODES)
    Shards(RecordConfig(task="reach", time_limit=1.0, seed=3, dataset=dataset)).begin(first)


def test_two_workers_record_the_same_and_a_merge_that_was_done_is_not_done_again(alone, tmp_path):
    root, shards = tmp_path / "d", tmp_path / ".d.shards"
    done = record(root, "--workers", 2)
    assert content(root) == alone
    assert os.listdir(tmp_path) == ["d"]
    assert f"{EPISODES} episodes, " in done.stderr
    plan(root, first=0)  # as if it was killed before they were removed
    times = started(root)
    record(root)
    assert started(root) == times
    assert not shards.exists()


@pytest.mark.slow
@pytest.mark.needs_gl
def test_the_pictures_are_the_same_too(tmp_path):
    flags = ["--cameras", "wrist", "--image_size", "64"]
    record(tmp_path / "alone", *flags, "--workers", "1", episodes=8)
    record(tmp_path / "shared", *flags, "--workers", "2", episodes=8)
    assert content(tmp_path / "shared") == content(tmp_path / "alone")
    pairs = list(zip(pictures(tmp_path / "alone"), pictures(tmp_path / "shared"), strict=True))
    assert len(pairs) == read_info(tmp_path / "alone").frames
    assert all(np.array_equal(one, other) for one, other in pairs)
    assert any(np.ptp(one) > 50 for one, _ in pairs)


def test_episodes_are_added_to_those_that_one_core_recorded(alone, tmp_path):
    root = tmp_path / "d"
    record(root, episodes=4)
    first = started(root)
    (root / "notes.txt").write_text("mine")
    record(root, "--resume", "--workers", "2", episodes=EPISODES - 4)
    assert content(root) == alone
    assert started(root)[:4] == first
    assert (root / "notes.txt").read_text() == "mine"


def begin(root, *flags):
    words = [sys.executable, "-m", "handrail.scripts", "record", str(root), *FLAGS, *map(str, flags)]
    return subprocess.Popen(
        [*words, "--dataset.num_episodes", str(EPISODES)],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    )


def test_killed_workers_and_a_killed_recording_lose_nothing_and_record_nothing_twice(alone, tmp_path):
    root, shards = tmp_path / "d", tmp_path / ".d.shards"
    process = begin(root, "--workers", 2)
    wait_until(lambda: saved(shards) or process.poll() is not None)
    workers = workers_of(process.pid)
    assert len(workers) == 2
    os.kill(workers[0], signal.SIGKILL)
    before = len(saved(shards))
    wait_until(lambda: len(saved(shards)) >= before + 4)
    workers = workers_of(process.pid)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    wait_until(lambda: not any(map(is_alive, workers)))
    kept = {path: path.read_bytes() for path in saved(shards)}
    assert 5 <= len(kept) < EPISODES
    told = "with seed 3, got 4: the same flags as then finish it"
    refused(root, *FLAGS, "--dataset.num_episodes", EPISODES, "--seed", 4, told=told)
    times = {time for path in kept for time in started(path.parents[3])}
    record(root, "--workers", 3)
    assert content(root) == alone
    assert times <= set(started(root))
    assert not shards.exists()


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_an_interrupt_ends_all_workers_and_one_core_goes_on(number, alone, tmp_path):
    root, shards = tmp_path / "d", tmp_path / ".d.shards"
    process = begin(root, "--workers", 2)
    wait_until(lambda: saved(shards) or process.poll() is not None)
    workers = workers_of(process.pid)
    process.send_signal(number)
    _, said = process.communicate(timeout=120)
    assert process.returncode == 130
    assert "interrupted; the recording is kept in" in said
    assert said.count("error:") == 1, said  # the workers say nothing
    assert "Traceback" not in said
    assert workers
    assert not any(map(is_alive, workers))
    kept = len(saved(shards))
    assert kept < EPISODES
    assert read_info(root).episodes == 0
    assert f"/{EPISODES - kept} succeeded" in record(root).stderr
    assert content(root) == alone


def test_a_disk_that_is_full_when_the_shards_are_put_together_costs_no_episode(alone, tmp_path):
    root = tmp_path / "d"
    with mock.patch(
        "handrail.collect.commands.shared.copy_episodes", side_effect=OSError(ENOSPC, "it is full")
    ):
        done = command(root, *FLAGS, "--dataset.num_episodes", EPISODES, "--workers", 2)
    assert done.returncode == 1
    assert f"cannot write dataset {str(root)!r}: it is full" in done.stderr
    assert read_info(root).episodes == 0
    times = {each for path in saved(tmp_path / ".d.shards") for each in started(path.parents[3])}
    assert len(times) >= 5
    record(root)
    assert content(root) == alone
    assert times <= set(started(root))


def test_a_dataset_that_has_changed_meanwhile_is_left_alone(alone, tmp_path):
    root, shards = tmp_path / "d", tmp_path / ".d.shards"
    record(root, episodes=2)
    plan(root, first=1)
    done = command(root, *FLAGS, "--dataset.num_episodes", EPISODES)
    assert done.returncode == 2
    assert "expected 1 episodes, as when" in done.stderr
    assert read_info(root).episodes == 2
    assert shards.exists()
    shutil.rmtree(shards)


def test_half_removed_shards_are_no_part_of_the_next_recording(alone, tmp_path):
    root, shards = tmp_path / "d", tmp_path / ".d.shards"
    record(tmp_path / "other", "--seed", "4", episodes=5)
    shards.mkdir()
    (tmp_path / "other").rename(shards / "shard-0000000")  # killed after their plan was removed
    record(root, "--workers", "2")
    assert content(root) == alone


@pytest.mark.parametrize(
    ("episodes", "settings", "expected"),
    [
        (99, {}, 1),
        (100, {}, 8),
        (100, {"workers": 1}, 1),
        (100, {"workers": 3}, 3),
        (5, {"workers": 3}, 3),
        (100, {"operator": "browser"}, 1),
        (100, {"realtime": True}, 1),
        (100, {"display_web": True}, 1),
        (
            100,
            {
                "robot": "lekiwi",
                "robot_client": "lekiwi",
                "client": ClientConfig(simulated=True),
                "task": "reach",
            },
            1,
        ),
    ],
)
def test_all_cores_record_where_that_pays_and_is_safe(episodes, settings, expected, monkeypatch):
    monkeypatch.setattr("handrail.collect.execution.config.cores", lambda: 8)
    config = RecordConfig(dataset=DatasetConfig(root="d", num_episodes=episodes), **settings)
    config.check()
    assert config.processes == expected


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--realtime"], "--workers 2: expected a recording without --realtime"),
        (["--operator", "browser"], "--workers 2: expected a recording without --operator browser"),
        (["--display_save", "x.rrd"], "--workers 2: expected a recording without --display_save"),
        (["--ray", "auto"], "--ray auto and --workers 2: expected one of them"),
    ],
)
def test_a_recording_that_workers_cannot_share_is_one_line(flags, words, tmp_path):
    refused(tmp_path / "d", *FLAGS, "--workers", "2", *flags, told=words)
    assert not os.listdir(tmp_path)


def test_episodes_set_aside_are_still_there_when_shards_have_become_a_part(tmp_path):
    root = tmp_path / "d"
    record(root, episodes=2)
    Layout(root).row(1).write_bytes(b"torn")
    assert repair(root, set_aside_damaged=True).episodes == 1
    kept = {path.name: path.read_bytes() for path in (root / ".damaged").rglob("*.parquet")}
    assert kept
    record(root, "--resume", "--workers", "2", episodes=6)
    assert read_info(root).episodes == 7
    assert {path.name: path.read_bytes() for path in (root / ".damaged").rglob("*.parquet")} == kept


def test_a_recording_that_runs_is_not_taken_for_one_that_was_cut_short(tmp_path):
    """Else the advice would be to remove the folder in which it saves."""
    root = tmp_path / "d"
    plan(root, 0)
    lock = FolderLock(Layout(root).staging)
    refused(root, *FLAGS, "--dataset.num_episodes", 3, told="is being written by another")
    assert Shards(RecordConfig(dataset=DatasetConfig(root=str(root)))).begun
    lock.release()
    refused(
        root, *FLAGS, "--dataset.num_episodes", 3, told="holds episodes of a recording that was cut short"
    )


@pytest.mark.parametrize("kept", [True, False])
def test_nothing_is_said_to_be_left_only_where_nothing_is(tmp_path, kept):
    said, log = [], RecordingLog(trouble="interrupted", kept=kept)
    console: Any = SimpleNamespace(print=lambda words, **look: said.append(words))
    log.report(RecordConfig(), tmp_path, 0, 0, console)
    assert ("no episode was saved: nothing is left behind" in said) != kept
