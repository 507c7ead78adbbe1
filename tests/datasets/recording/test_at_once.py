"""Whatever two processes do at once, an episode that one of them has saved stays."""

import contextlib
import os
import pkgutil
import shutil
import threading
from unittest import mock

import pytest
from datasets_helpers import create, fails, record, record_one, resume, tree

from handrail.controllers.errors import HandrailError
from handrail.datasets.editing.config import SplitConfig
from handrail.datasets.editing.edit import edit
from handrail.datasets.editing.merge import merge_datasets
from handrail.datasets.reading.check import check_report
from handrail.datasets.reading.reader import read_episodes
from handrail.datasets.recording import rewrite
from handrail.datasets.recording.repair import repair
from handrail.datasets.recording.rewrite import settle
from handrail.datasets.storage import lock
from handrail.datasets.storage.atomic import make_folder
from handrail.datasets.storage.lock import FolderLock, HeldError


@pytest.fixture
def meanwhile(monkeypatch):
    """Return what another process does when a dataset that is written anew gets its name, and after it."""
    real, others = rewrite.publish_folder, {"before": lambda: None, "after": lambda: None}

    def publish(*arguments):
        others["before"]()
        real(*arguments)
        others["after"]()

    monkeypatch.setattr(rewrite, "publish_folder", publish)
    return others


def merged(tmp_path):
    merge_datasets([tmp_path / "one", tmp_path / "two"], tmp_path / "out")


def split(tmp_path):
    parts = ("a=0", "b=1")
    edit(SplitConfig(folder=str(tmp_path / "one"), output=str(tmp_path / "out"), parts=parts))


@pytest.mark.parametrize("write", [merged, split])
def test_data_saved_under_the_name_meanwhile_are_never_replaced(tmp_path, meanwhile, write):
    for name in ("one", "two", "elsewhere"):
        record(tmp_path / name, 2)
    there = tree(tmp_path / "elsewhere")
    meanwhile["before"] = lambda: shutil.copytree(
        tmp_path / "elsewhere", tmp_path / "out", dirs_exist_ok=True
    )
    fails(lambda: write(tmp_path), "cannot write", "out")
    assert tree(tmp_path / "out") == there
    assert sorted(os.listdir(tmp_path)) == ["elsewhere", "one", "out", "two"]


def test_nobody_begins_a_dataset_while_another_is_written_under_its_name(tmp_path, meanwhile):
    for name in ("one", "two"):
        record(tmp_path / name, 2)
    meanwhile["before"] = lambda: fails(lambda: create(tmp_path / "out"), "being written by another")
    merged(tmp_path)
    assert len(read_episodes(tmp_path / "out")) == 4


def test_a_rewritten_dataset_is_held_by_one_alone(tmp_path, meanwhile):
    root, taken = record(tmp_path / "set", 2), []
    meanwhile["after"] = lambda: fails(lambda: taken.append(resume(root)), "another recorder")
    merge_datasets([root], root)
    assert [path.name for path in root.iterdir() if path.name.startswith(".")] == []
    with resume(root) as writer:
        fails(lambda: resume(root), "another recorder")
        assert record_one(writer, cameras=False) == 2


def test_a_lock_whose_folder_was_replaced_frees_nobody_elses(tmp_path):
    staging = tmp_path / "set" / ".handrail"
    first = FolderLock(staging)
    (tmp_path / "set").rename(tmp_path / "old")
    with FolderLock(staging):
        first.release()
        with pytest.raises(HeldError, match=f"dataset '{tmp_path / 'set'}' is being written by another"):
            FolderLock(staging)
    assert not staging.exists()


def test_a_lock_is_taken_where_its_folder_was_removed_at_that_moment(tmp_path, monkeypatch):
    staging, made = tmp_path / "set" / ".handrail", []

    def make(folder):
        make_folder(folder)
        made.append(folder)
        if len(made) == 1:
            folder.rmdir()

    monkeypatch.setattr(lock, "make_folder", make)
    with FolderLock(staging), pytest.raises(HeldError):
        FolderLock(staging)
    assert len(made) == 3


def test_a_repair_leaves_alone_what_is_just_getting_its_name(tmp_path, meanwhile):
    root = record(tmp_path / "set", 3)
    for other in (repair, settle, resume, lambda root: create(root, overwrite=True)):
        meanwhile["before"] = lambda other=other: fails(lambda: other(root), "being written by another")
        merge_datasets([root], root)
        assert len(read_episodes(root)) == 3
        assert not check_report(root)


@pytest.fixture
def cut(tmp_path):
    """A dataset whose edit ended between two names: nothing has its own."""
    root = record(tmp_path / "set", 3)
    real = os.replace

    def replace(source, target):
        if str(target) == str(root):
            raise KeyboardInterrupt
        real(source, target)

    with mock.patch.object(os, "replace", replace), pytest.raises(KeyboardInterrupt):
        merge_datasets([root], root)
    assert not root.exists()
    return root


@pytest.mark.parametrize(
    ("then", "words"),
    [
        (lambda root: create(root), "exists already"),
        (lambda root: merge_datasets([record(root.with_name("b"), 1)], root), "an edit was cut short"),
        (lambda root: merge_datasets([root], root), "an edit was cut short"),
    ],
)
def test_a_name_that_an_edit_was_about_to_take_is_not_free(cut, then, words):
    fails(lambda: read_episodes(cut), f"handrail-edit repair {cut}")
    fails(lambda: then(cut), words)
    assert len(read_episodes(cut)) == 3
    assert not list(cut.parent.glob(".set*"))


def test_resume_goes_on_where_an_edit_was_cut_short(cut):
    with resume(cut) as writer:
        assert record_one(writer, cameras=False) == 3
    assert not check_report(cut)


def resumed(root):
    with resume(root):
        pass


@pytest.mark.parametrize("killed", [False, True])
@pytest.mark.parametrize(
    ("write", "place"),
    [
        (resumed, "recording.writer.check_folders"),
        (repair, "recording.repair.check_folders"),
        (create, "recording.writer.settle"),
        (lambda root: merge_datasets([root.with_name("other")], root), "editing.source.settle"),
    ],
)
def test_an_edit_between_its_two_names_when_another_takes_the_lock(
    tmp_path, monkeypatch, write, place, killed
):
    """The other one has settled before the edit began: no dataset had the name when it took the lock."""
    root, real, edits = record(tmp_path / "set", 5), os.replace, []
    record(tmp_path / "other", 1)
    begun, between, end = threading.Event(), threading.Event(), threading.Event()

    def replace(source, target):
        if str(target) == str(root) and threading.current_thread() in edits:
            if killed:
                raise SystemExit
            between.set()
            end.wait()
        real(source, target)

    def merge():
        with contextlib.suppress(SystemExit):
            merge_datasets([root], root)
        between.set()

    monkeypatch.setattr(os, "replace", replace)
    was = pkgutil.resolve_name(f"handrail.datasets.{place}")

    def meanwhile(*arguments):
        answer = was(*arguments)
        if not begun.is_set():
            begun.set()
            edits.append(threading.Thread(target=merge))
            edits[0].start()
            between.wait()
        return answer

    monkeypatch.setattr(f"handrail.datasets.{place}", meanwhile)
    try:
        with pytest.raises(HandrailError):
            write(root)
    finally:
        end.set()
        edits[0].join()
    settle(root)
    assert len(read_episodes(root)) == 5
    assert not check_report(root)
    assert sorted(os.listdir(tmp_path)) == ["other", "set"]


def test_a_backup_beside_a_dataset_is_left_alone(tmp_path):
    root = record(tmp_path / "set", 2)
    there = tree(shutil.copytree(root, tmp_path / ".set.old"))
    merge_datasets([root], root)
    repair(root)
    with resume(root):
        pass
    assert tree(tmp_path / ".set.old") == there
