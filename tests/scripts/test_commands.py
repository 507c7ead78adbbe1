"""The commands' laws: one clear line for wrong input, nothing written; what is recorded replays."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from canned import canned, copied
from command_helpers import command, ran, refused

from handrail.collect.commands.replay import OpenDataset, replay_episode
from handrail.datasets.reading.reader import read_episodes, read_frames, read_info

RECORD = [sys.executable, "-m", "handrail.scripts", "record"]
REACH = ["--task", "reach", "--dataset.num_episodes", "2"]
MANY = [*RECORD, "--task", "reach", "--dataset.num_episodes", "500", "--workers", "1"]


def in_its_own_process(*arguments):
    return subprocess.run([*RECORD, *map(str, arguments)], capture_output=True, text=True, timeout=300)


def stamps(root):
    return {path.name: path.stat().st_mtime_ns for path in root.rglob("*") if path.is_file()}


def record_in_its_own_process(root):
    done = in_its_own_process(*REACH, "--dataset.root", root)
    assert done.returncode == 0, done.stderr


@pytest.fixture
def recorded():
    return canned(record_in_its_own_process)


WRONG = {
    "task": (["--task", "juggle"], "unknown task 'juggle': expected one of carry_box, drawer"),
    "mode": (["--mode", "telepathy"], "unknown mode 'telepathy': expected one of base"),
    "operator": (["--operator", "cat"], "unknown operator 'cat'"),
    "camera": (["--cameras", "wrist,roof"], "unknown camera 'roof'"),
    "mask size": (["--mask", "0101"], "expected 18 characters 0 or 1"),
    "fps 0": (["--dataset.fps", "0"], "--dataset.fps 0: expected 10 to 100"),
    "robot back in time": (
        ["--robot_fps", "-20"],
        "--robot_fps -20: expected a multiple of --dataset.fps 20",
    ),
    "few updates": (
        ["--mode", "direct", "--control_fps", "5"],
        "divisor of the robot's rate 20, at least 10",
    ),
    "late updates": (["--control_fps", "15"], "--control_fps 15: expected a divisor of the robot's rate 20"),
    "fps text": (["--dataset.fps", "fast"], "--dataset.fps"),
    "nan noise": (["--noise", "nan"], "--noise: expected a number >= 0.0, got nan"),
    "image size": (
        ["--image_size", "33"],
        "--image_size: expected a whole number that's a multiple of 2, got 33",
    ),
    "image size text": (["--image_size", "160x"], "--image_size: expected 128 or 160x120, got '160x'"),
    "robot": (["--robot", "spot"], "unknown robot 'spot'"),
    "flag": (["--speed", "9"], "--speed"),
    "repo id": (["--dataset.repo_id", "no spaces/please/ever"], "repo_id"),
    "movers elsewhere": (
        ["--moving_obstacles", "1"],
        "--moving_obstacles: expected --task reach, got --task",
    ),
    "both": (["--resume", "--overwrite"], "expected one of them"),
    "two viewers": (
        ["--display_data", "--display_web"],
        "--display_data and --display_web: expected one of them",
    ),
    "rrd": (["--display_save", "movie.mp4"], "expected a .rrd file in an existing folder"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input_is_one_clear_line_and_nothing_written(case, tmp_path):
    arguments, words = WRONG[case]
    refused(*arguments, "--dataset.root", tmp_path / "dataset", told=words)
    assert not (tmp_path / "dataset").exists()


def test_a_shell_gets_the_same_line_and_code(tmp_path):
    arguments = ["--task", "juggle", "--dataset.root", tmp_path / "dataset"]
    shell, here = in_its_own_process(*arguments), command(*arguments)
    assert (shell.returncode, shell.stdout, shell.stderr) == (here.returncode, here.stdout, here.stderr)


@pytest.mark.parametrize("words", [REACH, ["--task", "pick_place", "--resume"]])
def test_an_existing_dataset_is_never_overwritten_nor_continued_by_another_recording(words, recorded):
    before = stamps(recorded)
    line = refused(*words, "--dataset.root", recorded)
    assert "--resume" in words or {"--resume", "--overwrite"} <= set(line.split())
    assert stamps(recorded) == before


def test_a_demo_never_replaces_an_earlier_one(tmp_path):
    root = copied(tmp_path / "dataset", record_in_its_own_process)
    before = stamps(root)
    refused(tmp_path, name="demo", told="an earlier demo is there; say --overwrite")
    assert stamps(root) == before


def test_resume_of_nothing_and_a_folder_that_cannot_be_written_are_refused(tmp_path):
    refused(*REACH, "--dataset.root", tmp_path / "none", "--resume")
    assert not (tmp_path / "none").exists()
    (tmp_path / "file").write_text("not a folder")
    refused(*REACH, "--dataset.root", tmp_path / "file" / "dataset")
    assert (tmp_path / "file").read_text() == "not a folder"


def test_help_loads_nothing_heavy():
    """Not even scipy, whose import takes half as long as all the rest."""
    code = (
        "import sys, importlib.metadata\n"
        "heavy = {'torch', 'lerobot', 'mujoco', 'casadi', 'pinocchio', 'coal', 'datasets', 'rerun'}\n"
        "heavy |= {'scipy', 'numba'}\n"
        "for entry in importlib.metadata.distribution('handrail').entry_points:\n"
        "    if entry.group != 'console_scripts': continue\n"
        "    sys.argv = [entry.name, '--help']\n"
        "    try: entry.load()()\n"
        "    except SystemExit: pass\n"
        "    loaded = sorted(heavy & set(sys.modules))\n"
        "    if loaded: sys.exit(f'{entry.name}: {loaded}')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert not done.stderr
    assert done.stdout.count("usage: handrail") >= 14


def test_a_replay_repeats_the_recording_exactly(recorded):
    for episode in (0, 1):
        replay, _ = replay_episode(recorded, episode)
        assert replay.largest == 0.0
        assert replay.success == replay.recorded_success
    assert "0.00e+00" in ran("--dataset.root", recorded, name="replay")


def test_a_heading_that_begins_anew_is_no_deviation(recorded, monkeypatch):
    honest = OpenDataset.frames

    def leaps(*arguments):
        frames = honest(*arguments)
        state = frames["observation.state"].copy()
        state[len(state) // 2 :, 2] -= np.float32(2.0 * np.pi)
        return frames | {"observation.state": state}

    monkeypatch.setattr(OpenDataset, "frames", leaps)
    assert replay_episode(recorded, 0)[0].largest < 1e-5


def test_a_replay_shows_when_the_commands_differ(recorded, monkeypatch):
    """The deviation is measured, not assumed."""
    honest = OpenDataset.frames

    def tampered(*arguments):
        frames = honest(*arguments)
        return frames | {"action": frames["action"] * np.float32(0.9)}

    monkeypatch.setattr(OpenDataset, "frames", tampered)
    assert replay_episode(recorded, 0)[0].largest > 0.01


def test_resume_goes_on_with_new_seeds(tmp_path):
    root = copied(tmp_path / "copy", record_in_its_own_process)
    ran(*REACH, "--dataset.root", root, "--resume", "--mode", "switching")
    rows = read_episodes(root)
    assert len({row["seed"] for row in rows}) == len(rows) == 4
    assert [row["mode"] for row in rows] == ["ee", "ee", "switching", "switching"]


def test_the_same_seed_records_the_same_data(recorded, tmp_path):
    """Here as in the process of its own that recorded the first."""
    ran(*REACH, "--dataset.root", tmp_path / "again")
    first, again = read_frames(recorded, 1), read_frames(tmp_path / "again", 1)
    for key in set(first) - {"controller.solve_time", "wall_clock"}:
        np.testing.assert_array_equal(first[key], again[key], err_msg=key)


def saved_after(root, number, process):
    """Wait until a recording has saved some episodes."""
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and process.poll() is None:
        if len(list(root.glob("meta/episodes/*/*.parquet"))) >= number:
            return
        time.sleep(0.02)
    raise AssertionError(f"no {number} episodes came; exit code {process.poll()}")


@pytest.mark.parametrize("number", [pytest.param(signal.SIGINT, marks=pytest.mark.slow), signal.SIGTERM])
def test_an_interrupt_keeps_the_saved_episodes(number, tmp_path):
    root = tmp_path / "d"
    process = subprocess.Popen(
        [*MANY, "--dataset.root", str(root)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    saved_after(root, 2, process)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in said
    assert "interrupted" in said
    assert read_info(root).episodes == len(read_episodes(root)) >= 2


@pytest.mark.slow
def test_kill_at_random_moments_loses_at_most_the_open_episode(tmp_path):
    """The real command, killed 20 times, resumed each time."""
    rng = np.random.default_rng(0)
    root, kept, saved = tmp_path / "d", {}, 0
    arguments = [*MANY, "--dataset.root", str(root)]
    for kill in range(20):
        process = subprocess.Popen(
            [*arguments, *(["--resume"] if kill else [])],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            saved_after(root, saved + 1, process)
            time.sleep(rng.uniform(0.0, 0.6))
        finally:
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
        rows = sorted(root.glob("meta/episodes/*/*.parquet"))
        assert len(rows) > saved
        saved = len(rows)
        for path, content in kept.items():
            assert path.read_bytes() == content
        kept = {
            path: path.read_bytes() for path in [*rows, *sorted(root.glob("data/*/*.parquet"))[: len(rows)]]
        }
    ran(*REACH, "--dataset.root", root, "--resume")
    episodes = read_episodes(root)
    assert [row["episode_index"] for row in episodes] == list(range(len(episodes)))
    assert read_info(root).frames == sum(row["length"] for row in episodes)
    for row in episodes:
        np.testing.assert_array_equal(
            read_frames(root, row["episode_index"], ["frame_index"])["frame_index"], np.arange(row["length"])
        )
