"""A merge that fails or is killed changes nothing, or has done it all."""

import contextlib
import errno
import os
import shutil
from pathlib import Path

import pytest
from command_helpers import ran, refused
from datasets_guillotine import Guillotine
from datasets_helpers import TINY_FEATURES, record, resume, tree
from editing_helpers import content, part

from handrail.controllers.errors import HandrailError
from handrail.datasets.editing.config import DeleteConfig, SplitConfig
from handrail.datasets.editing.edit import edit
from handrail.datasets.editing.merge import drop_episodes, merge_datasets
from handrail.datasets.format.layout import Layout
from handrail.datasets.reading.check import check_report
from handrail.datasets.reading.reader import read_episodes
from handrail.datasets.recording.repair import repair
from handrail.datasets.recording.rewrite import drafted, settle
from handrail.scripts import cli

GUILLOTINE = Guillotine()


def test_a_merge_that_fails_changes_nothing(tmp_path):
    root, other = part(tmp_path / "one", 0, 2), part(tmp_path / "two", 2, 4)
    os.truncate(Layout(other).data(1), 30)
    before = tree(tmp_path)
    for output in (tmp_path / "new", root):
        with pytest.raises(HandrailError, match=r"two.*damaged"):
            merge_datasets([root, other], output)
        assert tree(tmp_path) == before


def test_a_dataset_that_was_copied_in_part_is_not_taken_for_an_empty_one(tmp_path):
    one, other = (record(tmp_path / name, 2, features=TINY_FEATURES) for name in ("one", "other"))
    shutil.rmtree(other / "meta" / "episodes")
    for act in (lambda: merge_datasets([one, other], tmp_path / "both"), lambda: drop_episodes(other, bool)):
        with pytest.raises(HandrailError, match="copied in part: 2 of 2 episodes"):
            act()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "other"]


@pytest.mark.parametrize("step", [8, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("in_place", [False, True])
def test_a_merge_killed_at_changes_to_the_disk(tmp_path, in_place, step):
    """The sources stay whole, the new dataset is there whole or not at all, and doing it again does it."""
    made = tmp_path / "made"
    one, other = (record(made / name, 2, features=TINY_FEATURES) for name in ("one", "other"))
    shard = tree(other)
    merge_datasets([one, other], tmp_path / "wanted")
    wanted, before = content(tmp_path / "wanted"), content(one)
    lived, k = False, 1 - step
    while not lived:
        k += step
        folder = shutil.copytree(made, tmp_path / str(k))
        roots = [folder / "one", folder / "other"]
        target = roots[0] if in_place else folder / "both"
        lived = GUILLOTINE.run(folder, k, lambda roots=roots, target=target: merge_datasets(roots, target))
        assert tree(roots[1]) == shard
        settle(target)  # as the next edit in its place would
        assert in_place or content(roots[0]) == before
        found = content(target) if target.exists() else None
        assert found in ((before, wanted) if in_place else (None, wanted))
        if found != wanted:
            merge_datasets(roots, target)
        assert content(target) == wanted
        assert repair(target).clean
    assert k > 8


@pytest.mark.parametrize("step", [8, pytest.param(1, marks=pytest.mark.slow)])
def test_a_split_killed_at_changes_to_the_disk_is_run_again(tmp_path, step):
    """The parts are there all together, or none of them is, and the same line does it."""
    root = record(tmp_path / "set", 4, features=TINY_FEATURES)
    line = [root, "--parts", "train=0-2", "test=3", "--output"]
    lived, k = False, 1 - step
    while not lived:
        k += step
        out = tmp_path / str(k) / "parts"
        out.parent.mkdir()
        config = cli.parse(SplitConfig, "handrail-edit split", [*map(str, line), str(out)])
        lived = GUILLOTINE.run(out.parent, k, lambda config=config: edit(config))
        if not out.exists():
            ran(*line, out, name="split")
        assert [path.name for path in out.parent.iterdir()] == ["parts"]
        assert [len(content(out / name)) for name in ("train", "test")] == [3, 1]
    assert k > 8


def test_a_merge_of_a_folder_with_itself_or_into_one_of_its_own_asks(tmp_path):
    root, other = part(tmp_path / "one", 0, 2), part(tmp_path / "two", 2, 4)
    (tmp_path / "link").symlink_to(root)
    before = tree(tmp_path)
    for line, said in (
        (("merge", root, root, "--output", tmp_path / "new"), "expected each folder once"),
        (("merge", root, tmp_path / "link", "--output", tmp_path / "new"), "expected each folder once"),
        (("merge", root, other, "--output", root), "another folder, or --in_place to replace it"),
        (("merge", root, other, "--output", tmp_path / "new", "--in_place"), "one of the folders"),
    ):
        refused(*line[1:], name=line[0], told=said)
        assert tree(tmp_path) == before
    ran(root, other, "--output", root, "--in_place", name="edit merge")
    assert len(content(root)) == 4


def test_edits_where_an_open_file_keeps_a_name_until_it_is_closed(tmp_path, monkeypatch):
    """NFS does that, so that the folder of a lock that is held cannot be removed."""
    root, (rmtree, unlink, rmdir) = record(tmp_path / "set", 2), (shutil.rmtree, Path.unlink, Path.rmdir)

    def clear(folder):
        held = {os.path.realpath(f"/proc/self/fd/{each}") for each in os.listdir("/proc/self/fd")}
        for hidden in set(folder.rglob(".nfs*")) - {Path(each) for each in held}:
            unlink(hidden)
        return held

    def removed(path, **how):
        held = str(path) in clear(path.parent)
        return path.rename(path.with_name(f".nfs_{path.name}")) if held else unlink(path, **how)

    def emptied(folder, ignore_errors=False):
        for path in folder.rglob("*"):
            if path.is_file() and not path.name.startswith(".nfs"):
                removed(path)
        clear(folder)
        for each in sorted(folder.rglob("*"), reverse=True):
            if each.is_dir() and not any(each.iterdir()):
                rmtree(each)
        if not any(folder.rglob(".nfs*")):
            rmtree(folder)
        elif not ignore_errors:
            raise OSError(errno.ENOTEMPTY, "Directory not empty", str(folder))

    monkeypatch.setattr(shutil, "rmtree", emptied)
    monkeypatch.setattr(Path, "unlink", removed)
    monkeypatch.setattr(Path, "rmdir", lambda path: (clear(path), rmdir(path)))
    for reason in "once", "again", "and again":
        labels = "--label", "failure", "--reason", reason
        ran(root, "--episodes", 0, *labels, "--in_place", name="edit relabel")
        clear(tmp_path)
    with resume(root):
        pass
    with pytest.raises(HandrailError, match="no episode"), drafted(root, True):
        raise HandrailError("no episode")
    assert not check_report(root)
    assert sorted(os.listdir(tmp_path)) == ["set"]


def test_an_edit_cut_short_as_the_old_files_go_is_not_done_twice(tmp_path, monkeypatch):
    made, real, k = record(tmp_path / "made", 4, features=TINY_FEATURES), os.unlink, 0
    left = set[int]()

    def unlink(path, dir_fd=None):
        if dir_fd is not None and ".set.replaced" in os.readlink(f"/proc/self/fd/{dir_fd}"):
            left.add(len(left))
            if len(left) == k:
                raise KeyboardInterrupt
        real(path, dir_fd=dir_fd)

    while len(left) == k:
        k, left = k + 1, set()
        root = shutil.copytree(made, tmp_path / str(k) / "set")
        config = cli.parse(DeleteConfig, "handrail-edit delete", [str(root), "--episodes", "0", "--in_place"])
        with monkeypatch.context() as patch, contextlib.suppress(KeyboardInterrupt):
            patch.setattr(os, "unlink", unlink)
            edit(config)
        if len(left) == k:
            with pytest.raises(HandrailError, match="an edit was cut short, and is finished now"):
                edit(config)
        assert [row["seed"] for row in read_episodes(root)] == [1, 2, 3]
    assert k > 10
