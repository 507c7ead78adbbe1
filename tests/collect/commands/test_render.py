"""Pictures that are drawn afterwards are those that recording would have taken, and nothing else changes."""

import numpy as np
import pytest
from canned import canned, copied
from command_helpers import command, ran, refused
from datasets_helpers import tree
from shared_helpers import content, pictures

from handrail.collect.commands import render
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.model import load_model
from handrail.datasets.reading.reader import OpenDataset, open_dataset, read_episodes, read_info
from handrail.datasets.recording.frames import PICTURE
from handrail.datasets.recording.writer import EpisodeWriter
from handrail.datasets.storage.lock import FolderLock

pytestmark = pytest.mark.needs_gl

FLAGS = ["--task", "reach", "--time_limit", "0.5", "--seed", "3"]
LOOK = ["--cameras", "wrist,scene", "--image_size", "64x48"]
EPISODES = 6  # two parts


def record(root, *flags, episodes=EPISODES):
    ran(root, *FLAGS, "--dataset.num_episodes", episodes, *flags)


def recorded(episodes=EPISODES):
    return canned(record, episodes=episodes)


def seen():
    return canned(record_and_draw)


def drawn(root, output, *flags, look=LOOK, workers=1):
    return ran(root, "--output", output, *look, "--workers", workers, *flags, name="edit render")


def record_and_draw(output, episodes=EPISODES):
    drawn(recorded(episodes), output)


def fails(root, output):
    """Return the line that says why drawing failed, below the bar."""
    done = command(root, "--output", output, *LOOK, "--workers", 1, name="edit render")
    *above, line = done.stderr.splitlines()
    assert (done.returncode, len(above)) == (2, 1), done.stderr
    assert line.startswith("error: ")
    return line


@pytest.fixture
def taken(monkeypatch):
    """The pictures that go into datasets, before they are coded."""
    found, add = [], EpisodeWriter.add_frame

    def add_frame(writer, frame, task):
        found.append({name: np.array(each) for name, each in frame.items() if name.startswith(PICTURE)})
        add(writer, frame, task)

    monkeypatch.setattr(EpisodeWriter, "add_frame", add_frame)
    return found


@pytest.fixture
def replayed(monkeypatch):
    """Which episodes are run again."""
    found, replay = [], render.replay_one_of

    def replay_one_of(dataset, episode, **named):
        found.append(episode)
        return replay(dataset, episode, **named)

    monkeypatch.setattr(render, "replay_one_of", replay_one_of)
    return found


def assert_same_pictures(some, others):
    assert len(some) == len(others)
    for one, other in zip(some, others, strict=True):
        assert one.keys() == other.keys()
        assert all(np.array_equal(one[name], other[name]) for name in one)


def test_pictures_drawn_afterwards_are_those_recorded_at_once(tmp_path, taken):
    record(tmp_path / "at_once", *LOOK)
    at_once = taken.copy()
    taken.clear()
    blind = recorded()
    taken.clear()
    drawn(blind, tmp_path / "drawn")
    assert_same_pictures(taken, at_once)
    assert taken[0].keys() == {PICTURE + "wrist", PICTURE + "scene"}
    assert {each.shape for frame in taken for each in frame.values()} == {(48, 64, 3)}
    assert all(np.ptp(each) > 50 for frame in taken for each in frame.values())
    pairs = list(zip(pictures(tmp_path / "drawn"), pictures(tmp_path / "at_once"), strict=True))
    assert len(pairs) == 2 * len(taken)
    assert all(np.array_equal(one, other) for one, other in pairs)
    assert content(tmp_path / "drawn") == content(tmp_path / "at_once")


def test_every_number_stays(tmp_path):
    blind, output = recorded(), seen()
    with open_dataset(blind) as before, open_dataset(output) as after:
        for episode, row in enumerate(before.rows):
            mine, theirs = after.frames(episode), before.frames(episode)
            assert mine.keys() == theirs.keys()
            for name in theirs:  # the clocks, too
                np.testing.assert_array_equal(mine[name], theirs[name], err_msg=name)
            kept = {name for name in row if not name.startswith(("stats/", "data/", "meta/"))}
            kept -= {"settings", "dataset_from_index", "dataset_to_index"}
            assert {name: after.row(episode)[name] for name in kept} == {name: row[name] for name in kept}
    ran(output, name="replay")


@pytest.mark.slow
def test_two_workers_write_the_same_bytes(tmp_path):
    drawn(recorded(), tmp_path / "two", workers=2)
    assert tree(tmp_path / "two") == tree(seen())


def test_an_episode_that_is_not_exact_is_named_and_the_same_command_finishes(tmp_path, replayed, monkeypatch):
    blind, output, frames = recorded(), tmp_path / "seen", OpenDataset.frames

    def of_another_version(dataset, episode, columns=None):
        found = frames(dataset, episode, columns)
        return found | {"action": found["action"] * 0.9} if episode == 4 else found

    with monkeypatch.context() as patch:
        patch.setattr(OpenDataset, "frames", of_another_version)
        said = fails(blind, output)
    assert f"episode 4 of {blind}: expected an exact replay, got one that deviates by " in said
    assert "drawn pictures are kept in " in said
    assert not output.exists()
    assert replayed == [0, 1, 2, 3, 4]
    replayed.clear()
    drawn(blind, output)
    assert replayed == [4, 5]
    assert tree(output) == tree(seen())
    assert [path.name for path in tmp_path.iterdir()] == ["seen"]


def test_pictures_of_something_else_are_drawn_anew(tmp_path, monkeypatch):
    """Its seeds are the same: it was recorded with another mode."""
    other, output = tmp_path / "other", tmp_path / "seen"

    def killed(*_):
        raise HandrailError("killed")

    record(other, "--mode", "base")
    with monkeypatch.context() as patch:
        patch.setattr(render, "merge_datasets", killed)
        assert "killed" in fails(other, output)
    assert (tmp_path / ".seen.pictures").is_dir()
    drawn(recorded(), output)
    assert tree(output) == tree(seen())


def test_nothing_is_left_where_nothing_could_be_drawn(tmp_path, monkeypatch):
    frames = OpenDataset.frames
    monkeypatch.setattr(
        OpenDataset, "frames", lambda *said: (found := frames(*said)) | {"action": found["action"] * 0.9}
    )
    said = fails(recorded(), tmp_path / "seen")
    assert "episode 0 of " in said
    assert "kept" not in said
    assert not list(tmp_path.iterdir())


def test_episodes_that_were_added_get_theirs(tmp_path, replayed):
    root = copied(tmp_path / "set", record, episodes=1)
    output = copied(tmp_path / "seen", record_and_draw, episodes=1)
    before = tree(output)
    replayed.clear()
    said = drawn(root, output)
    assert (replayed, tree(output)) == ([], before)
    assert said == f"{output}: 1 episodes, {read_info(root).frames} frames\n"
    record(root, "--resume", episodes=EPISODES - 1)
    drawn(root, output)
    assert replayed == [1, 2, 3, 4, 5]
    with open_dataset(output) as one, open_dataset(seen()) as other:
        for episode in range(EPISODES):
            states = (each.frames(episode)["observation.state"] for each in (one, other))
            np.testing.assert_array_equal(*states)
    pairs = list(zip(pictures(output), pictures(seen()), strict=True))
    assert all(np.array_equal(first, second) for first, second in pairs)


def test_an_episode_trimmed_at_its_beginning_has_to_be_drawn_before(tmp_path):
    """The robot crept then, which the commands that are left do not tell."""
    blind, trimmed = tmp_path / "blind", tmp_path / "trimmed"
    record(blind, "--time_limit", "4", episodes=1)
    ran(blind, "--output", trimmed, "--margin", "0", name="edit trim")
    assert read_episodes(trimmed)[0]["trimmed_start"] > 0
    assert fails(trimmed, tmp_path / "seen").endswith("its beginning was trimmed, so draw before you trim")
    drawn(blind, tmp_path / "seen")
    ran(tmp_path / "seen", "--output", tmp_path / "seen_trimmed", "--margin", "0", name="edit trim")
    with open_dataset(trimmed) as one, open_dataset(tmp_path / "seen_trimmed") as other:
        assert {name: each.tolist() for name, each in one.frames(0).items()} == {
            name: each.tolist() for name, each in other.frames(0).items()
        }


def refuses(output, told, *words, look=LOOK):
    before = tree(output)
    refused(recorded(), "--output", output, *look, *words, name="edit render", told=told)
    assert tree(output) == before


def test_an_output_that_is_something_else_is_refused(tmp_path):
    blind = copied(tmp_path / "blind", record, episodes=EPISODES)
    refuses(blind, "cannot add to it")
    refuses(copied(tmp_path / "seen", record_and_draw), "cannot add to it", look=["--cameras", "wrist"])
    other = tmp_path / "other"
    record(other, *LOOK, "--seed", "4", episodes=1)
    refuses(other, f"expected episodes of {recorded()}, found others")
    ran(blind, "--episodes", "0", "--label", "success", "--in_place", name="edit relabel")
    refused(blind, "--output", seen(), *LOOK, name="edit render", told=f"expected episodes of {blind}")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("mine")
    refuses(tmp_path / "mine", "expected a missing or empty folder")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--cameras", "rear"], "unknown camera 'rear': expected one of "),
        (["--cameras", "wrist", "--image_size", "0x64"], "--image_size"),
        (["--cameras", "wrist", "--workers", "-1"], "--workers -1"),
        ([], "expected --cameras, got none"),
    ],
)
def test_wrong_settings_are_one_line(words, told, tmp_path):
    words = [recorded(), "--output", tmp_path / "seen", *words]
    refused(*words, name="edit render", told=told)
    refused(recorded(), "--in_place", "--cameras", "wrist", name="edit render", told="expected --output")
    assert not list(tmp_path.iterdir())


def test_two_never_draw_one_dataset(tmp_path):
    output = tmp_path / "drawn"
    with FolderLock(tmp_path / ".drawn.lock"):
        refused(
            recorded(), "--output", output, *LOOK, name="edit render", told="by another handrail-edit render"
        )
    assert not output.exists()


def test_a_robot_whose_description_is_elsewhere_now_is_told(tmp_path):
    before, now, root = tmp_path / "then.toml", tmp_path / "now.toml", tmp_path / "set"
    before.write_text(ROBOTS["lekiwi"].file.read_text().replace('\nname = "lekiwi"', '\nname = "mine"'))
    record(root, "--robot", before, episodes=1)
    before.rename(now)
    load_model.cache_clear()  # as in another process
    refused(root, name="replay", told=f"unknown robot {str(before)!r}")
    assert "0.00e+00" in ran(root, "--robot", now, name="replay")
    refused(root, "--output", tmp_path / "drawn", *LOOK, name="edit render", told="--robot FILE.toml")
    drawn(root, tmp_path / "drawn", "--robot", now)
    assert read_info(tmp_path / "drawn").episodes == 1
