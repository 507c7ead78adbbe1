"""Packed or not, in shards or not: the same rows, pictures, lines and summaries, for us and for LeRobot."""

import os
import shutil
from itertools import pairwise

import numpy as np
import pyarrow.parquet as pq
import pytest
from canned import canned
from command_helpers import command, ran, refused
from datasets_helpers import (
    CAMERAS,
    check_pictures,
    keep_files,
    length_of,
    open_with_lerobot,
    record,
    record_one,
    resume,
    tree,
)
from editing_helpers import content, part, record_episodes
from hypothesis import given, settings
from hypothesis import strategies as st

from handrail.controllers.errors import HandrailError
from handrail.datasets.editing.merge import merge_datasets
from handrail.datasets.format import data_file
from handrail.datasets.format.layout import Layout
from handrail.datasets.reading.check import check_report
from handrail.datasets.reading.reader import read_episodes
from handrail.datasets.recording import file_group
from handrail.datasets.recording.repair import MOVED, repair
from handrail.datasets.recording.rewrite import settle

SUMMARIES = ("meta/info.json", "meta/stats.json", "meta/tasks.parquet", "meta/handrail.json")


def groups_of(path) -> list[list[int]]:
    """Return the episodes of each row group of a file."""
    with pq.ParquetFile(path) as file:
        read = [file.read_row_group(place, ["episode_index"]) for place in range(file.num_row_groups)]
    return [sorted(set(table["episode_index"].to_pylist())) for table in read]


@pytest.fixture(scope="module")
def whole():
    """Seven episodes recorded one after the other."""
    return canned(part, 0, 7)


@settings(max_examples=6, deadline=None)
@given(
    cuts=st.sets(st.integers(1, 6), max_size=3),
    most=st.sampled_from([1, 4000, file_group.MOST_ROWS]),
    rows=st.sampled_from([1, 25, data_file.ROWS]),
)
def test_shards_become_what_one_recording_is(whole, tmp_path_factory, cuts, most, rows):
    """To the byte in all that summarises; whatever the shards, however large a file or a group may be."""
    folder = tmp_path_factory.mktemp("shards")
    bounds = [0, *sorted(cuts), 7]
    roots = [part(folder / str(a), a, b) for a, b in pairwise(bounds)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(file_group, "MOST_ROWS", most)
        patch.setattr(data_file, "ROWS", rows)
        merge_datasets(roots, folder / "all")
        merge_datasets([folder / "all"], folder / "again")
    assert content(folder / "all") == content(whole)
    files, recorded = tree(folder / "all"), tree(whole)
    assert {name: files[name] for name in SUMMARIES} == {name: recorded[name] for name in SUMMARIES}
    written = sorted(name for name in files if name.startswith("data/"))
    assert len(written) in {1: [7], file_group.MOST_ROWS: [1]}.get(most, range(2, 7))
    groups = [group for name in written for group in groups_of(folder / "all" / name)]
    assert [episode for group in groups for episode in group] == list(range(7))
    assert all(sum(map(length_of, group)) <= rows for group in groups if len(group) > 1)
    assert tree(folder / "again") == files
    assert repair(folder / "all").clean
    assert not check_report(folder / "all")


def test_a_dataset_of_an_earlier_version_is_read_and_packed_anew(tmp_path, monkeypatch):
    """It has a row group an episode."""
    root, new = tmp_path / "set", part(tmp_path / "new", 0, 4)
    with monkeypatch.context() as earlier:
        earlier.setattr(data_file, "ROWS", 1)
        part(root, 0, 3)
        merge_datasets([root], root)
    assert groups_of(Layout(root).data(0)) == [[0], [1], [2]]
    with resume(root) as writer:
        record_one(writer, cameras=False)
    assert open_with_lerobot(root).num_episodes == 4
    assert content(root) == content(new)
    assert not check_report(root)
    for each in (root, new):
        merge_datasets([each], each)
    assert tree(root) == tree(new)


def test_a_changed_number_is_damage_whatever_column_it_is_in(tmp_path):
    """Pages have checksums: rows with a wrong number are not taken for rows that another tool wrote."""
    root = part(tmp_path / "set", 0, 4)
    merge_datasets([root], root)
    path = Layout(root).data(0)
    group = pq.read_metadata(path).row_group(0)
    raw = path.read_bytes()
    for place in range(group.num_columns):
        column = group.column(place)
        changed = bytearray(raw)
        first = column.dictionary_page_offset or column.data_page_offset
        changed[first + column.total_compressed_size - 3] ^= 1
        path.write_bytes(changed)
        faults = check_report(root)
        assert faults, column.path_in_schema
        assert not any("of like content" in fault for fault in faults), column.path_in_schema
    path.write_bytes(raw)
    assert not check_report(root)


def test_lerobot_sees_the_same_pictures(tmp_path):
    roots = [part(tmp_path / str(first), first, first + 2, cameras=True) for first in (0, 2)]
    merge_datasets(roots, tmp_path / "all")
    assert {path.name for path in (tmp_path / "all").rglob("*.mp4")} == {"file-000.mp4"}
    with resume(tmp_path / "all", cameras=True) as writer:
        assert record_one(writer, cameras=True) == 4
    found = open_with_lerobot(tmp_path / "all")
    assert len(found) == sum(map(length_of, range(5)))
    check_pictures(found, range(len(found)))


def test_a_packed_episode_is_cut_as_it_would_be_alone(tmp_path):
    """Also one that begins between two key frames: its pictures are encoded anew, in a file of their own."""
    root = record_episodes(tmp_path / "set", cameras=True)
    merge_datasets([root], tmp_path / "packed")
    for name in ("set", "packed"):
        for words in (["trim"], ["delete", "--episodes", "1"]):
            verb, *chosen = words
            ran(verb, tmp_path / name, *chosen, "--output", tmp_path / f"{verb}_{name}", name="edit")
    for verb in ("trim", "delete"):
        alone, packed = tmp_path / f"{verb}_set", tmp_path / f"{verb}_packed"
        assert content(alone) == content(packed)
        one, other = open_with_lerobot(alone), open_with_lerobot(packed)
        for index in range(0, len(one), 7):
            assert all(np.allclose(one[index][key], other[index][key], atol=0.02) for key in CAMERAS)


@pytest.mark.parametrize("stream", ["data", "videos"])
def test_damage_in_a_packed_file_is_named_and_can_be_set_aside(tmp_path, stream):
    root = record(tmp_path / "set", 4, cameras=True)
    merge_datasets([root], root)
    before = [frames for _, frames in content(root)]
    (path, *_) = sorted(path for path in (root / stream).rglob("*") if path.is_file())
    raw = bytearray(path.read_bytes())
    middle = len(raw) // 3
    raw[middle : middle + 200] = bytes(200)
    path.write_bytes(raw)
    with pytest.raises(HandrailError, match="is damaged"):
        resume(root, cameras=True)
    report = repair(root, set_aside_damaged=True)
    assert 0 < len(report.lost) <= 4
    assert report.episodes == 4 - len(report.lost)
    kept = [int(frames["observation.state"][0][0]) // 1000 for _, frames in content(root)]
    lost = [int(fault.split(":")[0].removeprefix("episode ")) for fault in report.lost]
    assert sorted(kept + lost) == [0, 1, 2, 3]
    for (_, frames), episode in zip(content(root), kept, strict=True):
        assert frames["action"] == before[episode]["action"]
    assert repair(root, set_aside_damaged=True).clean


def test_a_file_named_after_an_episode_of_a_packed_file_is_no_episode(tmp_path):
    root = part(tmp_path / "set", 0, 4)
    merge_datasets([root], root)
    before = content(root)
    shutil.copy(Layout(root).data(0), Layout(root).data(2))
    assert check_report(root) == ["data/chunk-000/file-002.parquet: no file of a LeRobot dataset"]
    report = repair(root)
    assert report.done[MOVED] == ("data/chunk-000/file-002.parquet",)
    assert report.complete
    assert content(root) == before


def test_datasets_without_an_episode_add_none(whole, tmp_path):
    empty, other = (part(tmp_path / name, 0, 0) for name in ("empty", "other"))
    merge_datasets([empty, whole, other], tmp_path / "both")
    assert content(tmp_path / "both") == content(whole)
    for roots, said in (([empty, other], "an episode or more"), ([whole, tmp_path / "none"], "none")):
        with pytest.raises(HandrailError, match=said):
            merge_datasets(roots, tmp_path / "new")
        assert not (tmp_path / "new").exists()


def test_the_commands_say_what_they_wrote(whole, tmp_path):
    done = command(whole, "--output", tmp_path / "packed", name="edit pack")
    assert done.stdout == f"{tmp_path / 'packed'}: 7 episodes, 74 frames (of 74)\n"
    root = part(tmp_path / "set", 0, 3)
    ran(root, name="edit pack")
    assert len(list(root.glob("data/*/*"))) == 1
    ran(root, whole, "--output", tmp_path / "both", name="edit merge")
    assert len(read_episodes(tmp_path / "both")) == 10
    for words, said in (
        ((root,), "two folders"),
        ((root, whole), "--output"),
        ((root, whole, "--output", root / "in"), "apart"),
        ((root, whole, "--output", tmp_path / "both"), "in use"),
    ):
        refused(*words, name="edit merge", told=said)


def test_a_link_to_nowhere_beside_a_dataset_stays(tmp_path):
    root = part(tmp_path / "set", 0, 2)
    (root / "notes").symlink_to(tmp_path / "gone")
    merge_datasets([root], root)
    assert (root / "notes").readlink() == tmp_path / "gone"
    assert not check_report(root)


def test_a_folder_that_cannot_be_removed_fails_no_edit(tmp_path, monkeypatch):
    root, real = part(tmp_path / "set", 0, 2), os.rmdir

    def rmdir(path, **options):
        if str(path).endswith("raw"):
            raise PermissionError(13, "Permission denied")
        real(path, **options)

    (root / "raw").mkdir()
    monkeypatch.setattr(os, "rmdir", rmdir)
    assert "replaced" not in str(merge_datasets([root], root))  # no episode is left there
    assert (tmp_path / ".set.replaced" / "raw").is_dir()
    assert repair(root).clean
    with resume(root) as writer:
        assert record_one(writer, cameras=False) == 2
    with pytest.raises(HandrailError, match=r"\.set\.replaced' is still there"):
        merge_datasets([root], root)
    monkeypatch.undo()
    assert not settle(root)  # no edit was cut short
    merge_datasets([root], root)
    assert len(read_episodes(root)) == 3


def test_an_edit_says_what_it_could_not_remove(tmp_path, monkeypatch):
    root = part(tmp_path / "set", 0, 2)
    keep_files(monkeypatch)
    assert ".set.replaced' could not be removed and holds" in str(merge_datasets([root], root))
    monkeypatch.undo()
    settle(root)
    assert "removed" not in str(merge_datasets([root], root))
