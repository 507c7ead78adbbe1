"""What is there is overwritten only when asked, and only what is ours."""

import pytest
from datasets_helpers import (
    create,
    fails,
    record,
    record_one,
    tree,
)

from handrail.datasets.format.layout import Layout
from handrail.datasets.reading.reader import read_episodes
from handrail.datasets.recording.repair import repair


def test_an_existing_dataset_is_not_overwritten(tmp_path):
    root = record(tmp_path / "set", 1)
    before = tree(root)
    fails(lambda: create(root), str(root), "exists already", "resume", "overwrite")
    assert tree(root) == before


def test_an_existing_dataset_is_overwritten_when_asked(tmp_path):
    root = record(tmp_path / "set", 3)
    (root / "notes.txt").write_text("mine")
    with create(root, cameras=True, overwrite=True) as writer:
        assert writer.num_episodes == 0
        record_one(writer, cameras=True)
    assert len(read_episodes(root)) == 1
    assert (root / "notes.txt").read_text() == "mine"
    assert len(list(root.glob("data/*/*"))) == 1


@pytest.mark.parametrize(
    "mine",
    [
        *("data/notes.txt", "data/chunk-000/mine.parquet", "videos/holiday.mp4", "meta/todo.md"),
        *(".damaged/notes.txt", ".damaged/000/data/chunk-000/mine.parquet"),
        ".damaged/chunk-000/file-001.mp4",
    ],
)
def test_overwriting_removes_only_what_is_ours(tmp_path, mine):
    root = record(tmp_path / "set", 1)
    (root / mine).parent.mkdir(parents=True, exist_ok=True)
    (root / mine).write_text("mine")
    (root / "images").mkdir()
    (root / "images" / "photo.png").write_text("mine too")
    before = tree(root)
    fails(lambda: create(root, overwrite=True), mine, "--overwrite", "only its own")
    assert tree(root) == before
    (root / mine).unlink()
    create(root, overwrite=True).close()
    assert (root / "images" / "photo.png").read_text() == "mine too"


def test_what_was_set_aside_is_overwritten_with_the_rest(tmp_path):
    root = record(tmp_path / "set", 3, cameras=True)
    Layout(root).data(0).write_bytes(b"torn")
    assert len(repair(root, set_aside_damaged=True).lost) == 1
    create(root, overwrite=True).close()
    assert not (root / ".damaged").exists()


def test_a_dataset_of_another_tool_is_never_overwritten(tmp_path):
    root = record(tmp_path / "set", 1)
    Layout(root).manifest.unlink()
    before = tree(root)
    fails(lambda: create(root, overwrite=True), "not recorded by Handrail", "never removed")
    assert tree(root) == before


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_folder_that_is_no_dataset_is_never_removed(tmp_path, overwrite):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.tex").write_text("years of work")
    before = tree(tmp_path)
    fails(lambda: create(tmp_path / "thesis", overwrite=overwrite), "chapter.tex", "never removed")
    fails(lambda: create(tmp_path, overwrite=overwrite), "thesis", "never removed")
    fails(lambda: create(tmp_path / "thesis" / "chapter.tex", overwrite=overwrite), "is a file")
    assert tree(tmp_path) == before
