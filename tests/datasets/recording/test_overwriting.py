"""What is there is overwritten or dropped only when asked, only what is ours, and the rest stays whole."""

import pytest
from canned import copied
from datasets_helpers import (
    check_is,
    create,
    fails,
    open_with_lerobot,
    record,
    record_one,
    resume,
    tree,
)

from handrail.controllers.errors import HandrailError
from handrail.datasets.editing.merge import drop_episodes, merge_datasets
from handrail.datasets.format.layout import Layout
from handrail.datasets.reading.check import check_report
from handrail.datasets.reading.reader import read_episodes, read_frames
from handrail.datasets.recording.repair import repair


def test_an_existing_dataset_is_not_overwritten(tmp_path):
    root = record(tmp_path / "set", 1)
    fails(lambda: create(root), str(root), "exists already", "resume", "overwrite", unchanged=root)


def test_an_existing_dataset_is_overwritten_when_asked(tmp_path):
    root = record(tmp_path / "set", 3)
    (root / "notes.txt").write_text("mine")
    with create(root, cameras=True, overwrite=True) as writer:
        assert writer.num_episodes == 0
        record_one(writer, cameras=True)
    assert len(read_episodes(root)) == 1
    assert (root / "notes.txt").read_text() == "mine"
    assert len(list(root.glob("data/*/*"))) == 1


def test_the_picture_of_a_card_is_ours(tmp_path):
    root = record(tmp_path / "set", 1)
    (root / "meta" / "preview.webp").write_bytes(b"a picture")
    create(root, overwrite=True).close()
    assert not (root / "meta" / "preview.webp").exists()


def test_episodes_set_aside_outlive_a_recording_without_an_episode(tmp_path):
    root = record(tmp_path / "set", 2)
    for number in range(2):
        Layout(root).row(number).write_bytes(b"torn")
    assert repair(root, set_aside_damaged=True).episodes == 0
    kept = tree(root / ".damaged")
    assert len(kept) == 4
    with resume(root) as writer:
        writer.erase_if_empty()
    assert tree(root / ".damaged") == kept


@pytest.mark.parametrize(
    "mine",
    [
        *("data/notes.txt", "data/chunk-000/mine.parquet", "videos/holiday.mp4", "meta/todo.md"),
        *(".damaged/notes.txt", ".damaged/000/data/chunk-000/mine.parquet"),
        *(".damaged/chunk-000/file-001.mp4", "videos/face/chunk-000/file-000.mp4"),
    ],
)
def test_overwriting_removes_only_what_is_ours(tmp_path, mine):
    root = record(tmp_path / "set", 1)
    (root / mine).parent.mkdir(parents=True, exist_ok=True)
    (root / mine).write_text("mine")
    (root / "images").mkdir()
    (root / "images" / "photo.png").write_text("mine too")
    fails(lambda: create(root, overwrite=True), mine, "--overwrite", "only its own", unchanged=root)
    (root / mine).unlink()
    create(root, overwrite=True).close()
    assert (root / "images" / "photo.png").read_text() == "mine too"


@pytest.mark.parametrize("mine", ["videos/notes.txt", "videos/face/chunk-000/file-001.mp4"])
def test_files_of_others_outlive_all_that_is_done_to_a_dataset(tmp_path, mine):
    """A folder of `videos` that is no camera of the dataset is not the dataset's."""
    root = record(tmp_path / "set", 1)
    (root / mine).parent.mkdir(parents=True)
    (root / mine).write_text("mine")
    merge_datasets([root], root)
    with resume(root) as writer:
        record_one(writer, cameras=False)
    assert repair(root).clean
    assert (root / mine).read_text() == "mine"


def test_files_of_others_outlive_a_recording_without_an_episode(tmp_path):
    root = tmp_path / "set"
    create(root).close()
    (root / "videos").mkdir(exist_ok=True)
    (root / "videos" / "notes.txt").write_text("mine")
    with resume(root) as writer:
        writer.erase_if_empty()
    assert (root / "videos" / "notes.txt").read_text() == "mine"


def test_episodes_set_aside_are_overwritten_with_the_rest(tmp_path):
    root = record(tmp_path / "set", 3, cameras=True)
    Layout(root).data(0).write_bytes(b"torn")
    assert len(repair(root, set_aside_damaged=True).lost) == 1
    create(root, overwrite=True).close()
    assert not (root / ".damaged").exists()


def test_a_dataset_of_another_tool_is_never_overwritten(tmp_path):
    root = record(tmp_path / "set", 1)
    Layout(root).manifest.unlink()
    words = ("not recorded by Handrail", "never removed")
    fails(lambda: create(root, overwrite=True), *words, unchanged=root)


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_folder_that_is_no_dataset_is_never_removed(tmp_path, overwrite):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.tex").write_text("years of work")
    for name, said in (("thesis", "chapter.tex"), ("", "thesis"), ("thesis/chapter.tex", "is a file")):
        fails(lambda at=tmp_path / name: create(at, overwrite=overwrite), said, unchanged=tmp_path)


@pytest.fixture
def recorded(tmp_path):
    return copied(tmp_path / "d", record, 5)


def odd(columns):
    return columns["seed"] % 2 == 1


def test_remaining_episodes_are_whole_and_move_up(tmp_path):
    recorded = copied(tmp_path / "d", record, 5, cameras=True)
    before = {row["seed"]: read_frames(recorded, row["episode_index"]) for row in read_episodes(recorded)}
    assert drop_episodes(recorded, odd) == 2
    with resume(recorded, cameras=True) as writer:  # it goes on
        assert writer.repaired.clean
        assert record_one(writer, cameras=True) == 3
    check_is(recorded, [0, 2, 4, 3])
    assert not check_report(recorded)
    for number, original in enumerate((0, 2, 4)):
        frames, old = read_frames(recorded, number), before[original]
        for name in set(old) - {"index", "episode_index", "task_index"}:
            assert (frames[name] == old[name]).all(), name
    assert open_with_lerobot(recorded).num_episodes == 4
    assert not [path for path in recorded.parent.iterdir() if path != recorded]


def test_nothing_to_drop_changes_nothing(recorded):
    before = tree(recorded)
    assert drop_episodes(recorded, lambda columns: False) == 0
    assert tree(recorded) == before


def test_without_episodes_there_is_no_dataset(recorded):
    assert drop_episodes(recorded, lambda columns: True) == 5
    assert not list(recorded.parent.iterdir())


def test_a_first_episode_that_was_cut_short_goes_with_its_dataset(tmp_path):
    root = tmp_path / "d"
    with create(root) as writer:
        (root / ".handrail" / "half").write_bytes(b"an episode")
        with pytest.raises(HandrailError, match="is being written by another"):
            drop_episodes(root, lambda columns: True)
        writer.discard_episode()
    Layout(root).damaged.mkdir()
    with pytest.raises(HandrailError, match=r"in \.damaged are episodes that were set aside"):
        drop_episodes(root, lambda columns: True)
    Layout(root).damaged.rmdir()
    assert drop_episodes(root, lambda columns: True) == 0
    assert not list(tmp_path.iterdir())


def test_episodes_set_aside_are_not_passed_over(recorded):
    Layout(recorded).damaged.mkdir()
    with pytest.raises(HandrailError, match=r"in \.damaged are episodes that were set aside"):
        drop_episodes(recorded, odd)
    assert len(read_episodes(recorded)) == 5


def test_a_dataset_in_use_is_left_alone(recorded):
    with resume(recorded, cameras=False), pytest.raises(HandrailError, match="is being written by another"):
        drop_episodes(recorded, odd)
    assert len(read_episodes(recorded)) == 5


def test_a_folder_with_nothing_but_a_link_for_our_files_is_no_empty_one(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("mine")
    (tmp_path / "set").mkdir()
    (tmp_path / "set" / ".handrail").symlink_to(tmp_path / "mine")
    fails(lambda: create(tmp_path / "set"), "found a link at .handrail")
    assert (tmp_path / "mine" / "thesis.tex").read_text() == "mine"
