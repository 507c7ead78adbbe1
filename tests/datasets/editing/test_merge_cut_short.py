"""A merge that fails or is killed changes nothing, or has done it all."""

import os
import shutil

import pytest
from command_helpers import ran, refused
from datasets_guillotine import Guillotine
from datasets_helpers import TINY_FEATURES, record, tree
from editing_helpers import content, part

from handrail.controllers.errors import HandrailError
from handrail.datasets.editing.config import SplitConfig
from handrail.datasets.editing.edit import edit
from handrail.datasets.editing.merge import drop_episodes, merge_datasets
from handrail.datasets.format.layout import Layout
from handrail.datasets.recording.repair import repair
from handrail.datasets.recording.rewrite import settle
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
