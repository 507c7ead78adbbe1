"""Whatever is edited, what stays is what was recorded: every column, picture and line of metadata."""

import shlex
from types import SimpleNamespace

import numpy as np
import pytest
from canned import canned, copied
from command_helpers import command
from datasets_helpers import CAMERAS, TASKS, brightness, open_with_lerobot, tree
from editing_helpers import LENGTH, MOVING, STILL, record_episodes

from handrail.datasets.editing.edit import moving_stretch
from handrail.datasets.editing.merge import drop_episodes
from handrail.datasets.format.layout import Layout
from handrail.datasets.reading.check import check_report
from handrail.datasets.reading.reader import read_episodes, read_frames
from handrail.datasets.recording.repair import repair

COUNTERS = {"index", "episode_index", "frame_index", "timestamp", "task_index"}
OWN = {"episode_index", "dataset_from_index", "dataset_to_index", "length", "tasks"}
WHOLE = (0, LENGTH)


@pytest.fixture(scope="module")
def recorded():
    return canned(record_episodes, cameras=True)


def edit(line, *folders, code=0):
    verb, *words = shlex.split(line)
    done = command(verb, *folders, *words, name="edit")
    assert done.returncode == code, done.stderr
    return done


def check(root, recorded, numbers, changed=(), stretches=None):
    """Check that a dataset is the stretches of old episodes, and nothing else but what is said to be."""
    assert not check_report(root)
    assert repair(root).clean
    rows, before = read_episodes(root), read_episodes(recorded)
    assert [row["seed"] for row in rows] == list(numbers)
    opened, start = open_with_lerobot(root), 0
    for number, (row, old) in enumerate(zip(rows, numbers, strict=True)):
        first, length = (stretches or {}).get(old, WHOLE)
        assert (row["episode_index"], row["dataset_from_index"], row["length"]) == (number, start, length)
        same = set(before[old]) - OWN - set(changed)
        same = {name for name in same if "/" not in name}
        assert {name: row[name] for name in same} == {name: before[old][name] for name in same}
        new, frames = read_frames(root, number), read_frames(recorded, old)
        for name in set(frames) - COUNTERS - set(changed):
            assert (new[name] == frames[name][first : first + length]).all(), name
        assert (new["frame_index"] == np.arange(length)).all()
        assert (new["index"] == np.arange(length) + start).all()
        assert new["timestamp"] == pytest.approx(np.arange(length) / 30)
        for frame in (0, length - 1):
            item = opened[start + frame]
            for camera, key in enumerate(CAMERAS):
                level = float(item[key].mean()) * 255
                assert abs(level - brightness(old, first + frame, camera)) < 2.5, (old, frame)
        start += length
    assert len(opened) == start


@pytest.mark.parametrize(
    ("line", "left"),
    [
        ("delete --episodes 1", (0, 2, 3)),
        ("delete --episodes failed", (0, 2)),
        ("keep --episodes 1-2 0", (0, 1, 2)),
        ("keep --episodes succeeded,3", (0, 2, 3)),
    ],
)
def test_chosen_episodes_stay_whole(recorded, tmp_path, line, left):
    before = tree(recorded)
    edit(f"{line} --output {tmp_path / 'new'}", recorded)
    check(tmp_path / "new", recorded, left)
    assert tree(recorded) == before


@pytest.mark.parametrize(("words", "test"), [("train=0.75 test=0.25", [3]), ("train=0,1,2 test=3", [3])])
def test_parts_have_each_episode_once(recorded, tmp_path, words, test):
    edit(f"split --parts {words} --output {tmp_path / 'parts'}", recorded)
    check(tmp_path / "parts" / "train", recorded, [0, 1, 2])
    check(tmp_path / "parts" / "test", recorded, test)


def test_merging_the_parts_gives_the_whole(recorded, tmp_path):
    parts = tmp_path / "parts"
    edit(f"split --parts a=0.5 b=0.5 --output {parts}", recorded)
    edit(f"merge --output {tmp_path / 'all'} --name handrail/test", parts / "a", parts / "b")
    check(tmp_path / "all", recorded, range(4))
    new, old = Layout(tmp_path / "all"), Layout(recorded)
    for one, other in ((new.info, old.info), (new.stats, old.stats), (new.manifest, old.manifest)):
        assert one.read_bytes() == other.read_bytes()


def test_idle_ends_are_cut_and_success_is_not(recorded, tmp_path):
    edit(f"trim --output {tmp_path / 'new'}", recorded)
    rows = read_episodes(tmp_path / "new")
    first = STILL - 7
    first -= first % 2  # a group of pictures
    assert {row["trimmed_start"] for row in rows} == {first}
    spans = {number: (first, rows[number]["length"]) for number in range(4)}
    assert {length for _, length in spans.values()} == {STILL + MOVING + 1 + 8 - first}  # 0.25 s at 30 Hz
    check(tmp_path / "new", recorded, range(4), ["trimmed_start", "next.done"], spans)
    for number in range(4):
        frames = read_frames(tmp_path / "new", number)
        assert frames["next.success"].any() == (number % 2 == 0)
        assert np.flatnonzero(frames["next.done"]).tolist() == [len(frames["next.done"]) - 1]
    edit(f"trim --output {tmp_path / 'again'}", tmp_path / "new")
    again = read_episodes(tmp_path / "again")
    assert [row["length"] for row in again] == [row["length"] for row in rows]
    edit(f"relabel --episodes 1 --label success --output {tmp_path / 'late'}", recorded)  # its last frame
    edit("trim --in_place", tmp_path / "late")
    assert read_episodes(tmp_path / "late")[1]["length"] == LENGTH - first


def test_videos_are_copied_not_encoded_anew(recorded, tmp_path, monkeypatch):
    def never(*_):
        raise AssertionError("encoded anew")

    monkeypatch.setattr("handrail.datasets.format.video.VideoEncoder.add", never)
    edit(f"trim --output {tmp_path / 'new'}", recorded)


def test_labels_are_changed_in_lines_and_frames(recorded, tmp_path):
    label = "relabel --episodes 0 --label failure --reason slipped"
    edit(f"{label} --output {tmp_path / 'one'}", recorded)
    edit("relabel --episodes 1,3 --label success --in_place", tmp_path / "one")
    check(tmp_path / "one", recorded, range(4), ["success", "failure_reason", "next.success"])
    rows = read_episodes(tmp_path / "one")
    assert [row["success"] for row in rows] == [False, True, True, True]
    assert [row["failure_reason"] for row in rows] == ["slipped", "", "", ""]
    for number, row in enumerate(rows):
        assert read_frames(tmp_path / "one", number)["next.success"].any() == row["success"]


def test_tasks_are_renamed(recorded, tmp_path):
    edit(f"rename --task 'raise it' --old_task '{TASKS[0]}' --output {tmp_path / 'new'}", recorded)
    check(tmp_path / "new", recorded, range(4))
    assert [row["tasks"] for row in read_episodes(tmp_path / "new")] == [["raise it"]] * 2 + [[TASKS[1]]] * 2
    edit(f"rename --task '{TASKS[1]}' --in_place", tmp_path / "new")
    check(tmp_path / "new", recorded, range(4))
    assert list(open_with_lerobot(tmp_path / "new").meta.tasks.index) == [TASKS[1]]


def test_in_place_what_lies_beside_stays(recorded, tmp_path):
    edit(f"keep --episodes 0-3 --output {tmp_path / 'set'}", recorded)
    (tmp_path / "set" / "notes.txt").write_text("mine")
    edit("delete --episodes 0 --in_place", tmp_path / "set")
    check(tmp_path / "set", recorded, [1, 2, 3])
    assert (tmp_path / "set" / "notes.txt").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_merged_columns_are_those_of_all(tmp_path):
    one = record_episodes(tmp_path / "one", 1, mode="ee")
    other = record_episodes(tmp_path / "other", 1, noise=0.5)
    edit(f"merge --output {tmp_path / 'all'}", one, other)
    first, second = read_episodes(tmp_path / "all")
    assert (first["mode"], first["noise"]) == ("ee", None)
    assert (second["mode"], second["noise"]) == ("", 0.5)
    assert not check_report(tmp_path / "all")


MISTAKES = {
    "delete --in_place": "expected --episodes",
    "delete --episodes 4 --in_place": "expected episodes from 0 to 3",
    "delete --episodes 0-3 --in_place": "expected at least one episode",
    "delete --episodes x --in_place": "expected a number, a range",
    "delete --episodes 1": "expected --output",
    "delete --episodes 1 --task x --in_place": "Unrecognized options: --task",
    "split --parts a=0.7 b=0.7 --output OUT": "shares up to 1",
    "split --parts a=0,1 b=1 --output OUT": "episode 1 in two",
    "split --parts a/b=0.5 --output OUT": "expected a name",
    "split --parts a=0.01 --output OUT": "got none",
    "merge --output OUT": "two folders or more",
    "relabel --episodes 1 --label success --reason x --in_place": "with --label failure",
    "rename --task x --old_task lift --in_place": TASKS[0],
    "trim --margin -1 --in_place": "0 or more",
    "trim --output SET/inside": "apart from",
}


@pytest.mark.parametrize("line", MISTAKES)
def test_a_mistake_is_one_line_and_changes_nothing(tmp_path, line):
    root = copied(tmp_path / "set", record_episodes)
    before = tree(tmp_path)
    done = edit(line.replace("OUT", str(tmp_path / "out")).replace("SET", str(root)), root, code=2)
    assert done.stderr.count("\n") == 1
    assert MISTAKES[line] in done.stderr
    assert tree(tmp_path) == before


def test_datasets_of_other_tools_are_not_edited(tmp_path):
    root = copied(tmp_path / "set", record_episodes)
    Layout(root).manifest.unlink()
    assert "lerobot-edit-dataset edits it" in edit("trim --in_place", root, code=2).stderr


def test_a_damaged_dataset_is_not_edited(tmp_path):
    root = copied(tmp_path / "set", record_episodes)
    Layout(root).data(1).unlink()
    said = edit(f"delete --episodes 0 --output {tmp_path / 'new'}", root, code=2).stderr
    assert "episode 1: data/chunk-000/file-001.parquet is missing" in said
    assert not (tmp_path / "new").exists()


def test_an_edit_that_was_cut_short_is_finished_and_not_done_twice(tmp_path):
    """Killed between two renames, the same line again would delete another episode."""
    root = copied(tmp_path / "set", record_episodes)
    edit(f"delete --episodes 0 --output {tmp_path / '.set.partial'}", root)
    root.rename(tmp_path / ".set.replaced")
    said = edit("delete --episodes 0 --in_place", root, code=2).stderr
    assert "was cut short, and is finished now" in said
    assert [row["seed"] for row in read_episodes(root)] == [1, 2, 3]
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


MINE = ("notes.txt", "meta/notes.txt", "data/chunk-000/notes.txt", "videos/mine/notes.txt")


@pytest.mark.parametrize("mine", MINE)
def test_an_edit_in_place_keeps_what_others_put_there(recorded, tmp_path, mine):
    root = copied(tmp_path / "set", record_episodes, cameras=True)
    (root / mine).parent.mkdir(exist_ok=True)
    (root / mine).write_text("mine")
    edit("delete --episodes 0 --in_place", root)
    assert (root / mine).read_text() == "mine"
    assert not (root / "data/chunk-000/file-001.parquet").exists()
    check(root, recorded, [1, 2, 3])


def test_an_edit_in_place_removes_no_file_of_no_episode(tmp_path):
    root = copied(tmp_path / "set", record_episodes, cameras=True)
    stray = root / "data/chunk-000/mine.parquet"
    stray.write_bytes(b"mine")
    assert ".damaged" in edit("delete --episodes 0 --in_place", root, code=2).stderr
    assert stray.read_bytes() == b"mine"
    assert len(read_episodes(root)) == 4


@pytest.mark.parametrize("output", ["--in_place", "--output {}/new"])
def test_a_link_stays_and_what_it_leads_to_is_edited(recorded, tmp_path, output):
    for name in ("set", "new"):
        (tmp_path / "far").mkdir(exist_ok=True)
        (tmp_path / name).symlink_to(tmp_path / "far" / name)
    copied(tmp_path / "far" / "set", record_episodes, cameras=True)
    edit(f"delete --episodes 0 {output.format(tmp_path)}", tmp_path / "set")
    check(tmp_path / "far" / ("set" if output == "--in_place" else "new"), recorded, [1, 2, 3])
    assert all((tmp_path / name).is_symlink() for name in ("set", "new"))


def test_episodes_dropped_behind_a_link_are_gone(tmp_path):
    root = copied(tmp_path / "far", record_episodes, cameras=True)
    (tmp_path / "set").symlink_to(root)
    assert drop_episodes(tmp_path / "set", lambda row: row["seed"] > 1) == 2
    assert [row["seed"] for row in read_episodes(root)] == [0, 1]
    assert drop_episodes(tmp_path / "set", lambda row: True) == 2
    assert not root.exists()


@pytest.mark.parametrize(
    "lasting", [{0: 10, 0.0055: 10, 0.0045: 20}, {0: 10, -0.004: 2, 0.003: 28, 0.0055: 5}]
)
def test_an_episode_that_hardly_moves_is_not_trimmed(lasting):
    values = np.repeat(list(lasting), list(lasting.values()))
    state = np.append(values, np.full(15 * (-0.004 in lasting), 0.003))[:, None]
    info = SimpleNamespace(features={}, fps=20)
    episode = SimpleNamespace(configuration=state, count=len(state), fps=20, frames={}, info=info)
    episode.entries, episode.matrix = lambda part: ("a.pos",), lambda part: state
    assert moving_stretch(episode, 0.25) == (0, len(state))


def test_a_success_before_anything_moves_is_not_cut_off():
    state = np.clip(np.arange(100.0) - 40, 0, 20)[:, None] / 20
    info, frames = SimpleNamespace(features={}, fps=20), {"next.success": np.arange(100) == 2}
    episode = SimpleNamespace(configuration=state, count=100, fps=20, frames=frames, info=info)
    episode.entries, episode.matrix = lambda part: ("a.pos",), lambda part: state
    assert moving_stretch(episode, 0.0)[0] == 2


def test_a_gripper_that_moves_is_not_idle():
    """The base moves in frames 50 to 100; the gripper closes before, and opens after it."""
    steps = np.arange(200)
    state = np.column_stack(
        [np.clip(steps - 50, 0, 50) / 50, np.clip(steps - 5, 0, 25) - (steps > 150) * 25.0]
    )
    names, info = ("base.pos", "gripper.opening"), SimpleNamespace(features={}, fps=20)
    episode = SimpleNamespace(configuration=state[:, :1], count=200, fps=20, frames={}, info=info)
    episode.entries, episode.matrix = lambda part: names, lambda part: state
    assert moving_stretch(episode, 0.0) == (6, 146)
