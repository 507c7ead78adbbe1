"""Damage is noticed before a dataset is used: cheaply where nothing has changed, fully when asked."""

import json
import os
import shutil

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from canned import copied
from command_helpers import command, ran, refused
from compare_helpers import JOINTS, lerobot_dataset, quick_and_slow
from datasets_helpers import TINY_FEATURES, create, record, record_one, resume, tree
from editing_helpers import content

from handrail.controllers.errors import HandrailError
from handrail.datasets.editing.merge import merge_datasets
from handrail.datasets.format.episode_rows import EpisodeRows
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.metadata import Checksum
from handrail.datasets.format.schema import Feature
from handrail.datasets.reading.check import check_report, check_whole
from handrail.datasets.reading.reader import read_episodes, read_frames
from handrail.datasets.recording import checksums
from handrail.datasets.recording.repair import repair
from handrail.policies.imitation.config import StoredConfig, TrainConfig
from handrail.policies.imitation.training.source import read_source


@pytest.fixture
def hashed(monkeypatch):
    """Return which files are read in full."""
    names, real = [], Checksum.of.__func__
    monkeypatch.setattr(
        Checksum, "of", classmethod(lambda cls, path: names.append(path.name) or real(cls, path))
    )
    return names


def _harm(path, same_time=False):
    """Change a number of a parquet file; its size stays, and its time if asked."""
    times = path.stat()
    content = bytearray(path.read_bytes())
    content[60:70] = bytes(10)
    path.write_bytes(content)
    if same_time:
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))


def test_a_whole_dataset_is_hashed_once(root, hashed):
    check_whole(root)
    assert len(hashed) == 12
    check_whole(root)
    assert len(hashed) == 12
    os.utime(Layout(root).data(1))
    check_whole(root)
    assert len(hashed) == 13
    check_whole(root, verify=True)
    assert len(hashed) == 25


def test_torn_memory_is_no_memory(root, hashed):
    check_whole(root)
    for torn in (b"{", b"[]", b'{"data/chunk-000/file-000.parquet": 3}', b"\xff" * 9):
        for path in checksums.memory_folder().iterdir():
            path.write_bytes(torn)
        hashed.clear()
        check_whole(root)
        assert len(hashed) == 12


@pytest.mark.parametrize("same_time", [False, True])
def test_changed_rows_are_noticed(root, same_time):
    check_whole(root)
    _harm(Layout(root).data(1), same_time)
    with pytest.raises(HandrailError, match=r"\A[^\n]*episode 1: data/chunk-000/file-001[^\n]*\Z"):
        check_whole(root)
    assert len(check_report(root)) == 1


def test_training_and_comparison_notice(tmp_path):
    root = copied(tmp_path / "sets", quick_and_slow)
    output = tmp_path / "report"
    arguments = (root / "quick", root / "slow", "--output", output, "--no_pictures")
    ran(*arguments, name="compare")
    config = TrainConfig(dataset=StoredConfig(root=str(root / "slow")), actions="recorded")
    assert read_source(config).info.episodes == 12
    _harm(Layout(root / "slow").data(4))
    before = tree(output)
    refused(*arguments, name="compare", told="episode 4")
    assert tree(output) == before
    with pytest.raises(HandrailError, match="episode 4"):
        read_source(config)


def test_a_dataset_of_lerobot_copied_in_part_is_named_as_such(tmp_path):
    root = lerobot_dataset(tmp_path / "set", JOINTS, 30, 0.0, camera=True)
    check_whole(root)
    assert check_report(root) == []
    assert ran("--dataset.root", root, "--check", name="inspect").startswith("checked: all can be read (no ")
    next(root.glob("videos/*/*/*.mp4")).unlink()
    with pytest.raises(HandrailError, match=r"copied in part: .* files are missing \(videos/"):
        check_whole(root)
    assert len(check_report(root)) == 1
    next(root.glob("data/*/*.parquet")).unlink()
    done = command("--dataset.root", root, "--check", name="inspect")
    assert done.returncode == 1
    assert "episode 5" in done.stdout


def test_lerobot_s_additions_are_read_and_checked(tmp_path):
    """A dataset that LeRobot has recorded on has lines without checksums: it is read, but not resumed."""
    root = record(tmp_path / "set", 2)
    layout = Layout(root)
    for number in range(2):
        table = pq.read_table(layout.row(number))
        pq.write_table(table.replace_schema_metadata(None), layout.row(number))
    check_whole(root)
    assert check_report(root) == []


def test_statistics_that_are_no_json_are_noticed(root):
    stats = json.loads(Layout(root).stats.read_bytes())
    stats["action"]["max"] = [np.inf, 1.0]
    Layout(root).stats.write_text(json.dumps(stats))
    assert [fault.partition(":")[0] for fault in check_report(root)] == ["meta/stats.json"]


@pytest.mark.parametrize("kept", [0.5, 0.0])
def test_a_video_of_lerobot_that_is_cut_off_is_noticed(tmp_path, kept):
    root = lerobot_dataset(tmp_path / "set", JOINTS, 30, 0.0, camera=True)
    video = next(root.glob("videos/*/*/*.mp4"))
    os.truncate(video, int(kept * video.stat().st_size))
    assert "file-000.mp4" in check_report(root)[0]


def test_a_packed_dataset_that_was_copied_over_its_single_files_is_read_as_packed(tmp_path):
    root = record(tmp_path / "set", 4)
    single = shutil.copytree(root, tmp_path / "copy")
    merge_datasets([root], root)
    wanted = content(root)
    shutil.copytree(root, single, dirs_exist_ok=True)
    assert len(check_report(single)) == 6  # rows and lines of three episodes
    with resume(single) as writer:
        assert record_one(writer, cameras=False) == 4
    assert content(single)[:4] == wanted
    assert check_report(single) == []
    assert len([path for path in (single / ".damaged").rglob("*") if path.is_file()]) == 6


@pytest.mark.parametrize("said", [None, "x"])
def test_a_place_in_a_video_that_is_no_number_is_one_line(tmp_path, said):
    root = lerobot_dataset(tmp_path / "set", JOINTS, 30, 0.0, camera=True)
    path = next(root.glob("meta/episodes/*/*"))
    table = pq.read_table(path)
    name = next(name for name in table.column_names if name.endswith("from_timestamp"))
    place = table.schema.get_field_index(name)
    pq.write_table(table.set_column(place, name, pa.array([said] * len(table))), path)
    assert "episode 0: " in check_report(root)[0]


@pytest.mark.parametrize("name", ["safety.contacts", "engaged"])
def test_a_value_that_is_not_there_is_no_number(tmp_path, name):
    root = record(tmp_path / "set", 1)
    path = Layout(root).data(0)
    table = pq.read_table(path)
    place = table.schema.get_field_index(name)
    values = table.column(name).to_pylist()
    gap = pa.array([*values[:2], None, *values[3:]], table.schema.field(place).type)
    pq.write_table(table.set_column(place, name, gap), path)
    with pytest.raises(HandrailError, match=r"\A[^\n]*1 rows without a value, expected (int64|bool)[^\n]*\Z"):
        read_frames(root, 0)


def test_a_number_that_is_not_there_in_a_list_is_no_number(tmp_path):
    root = tmp_path / "set"
    with create(root, features={"counts": Feature("int64", (2,))}) as writer:
        for index in range(3):
            writer.add_frame({"counts": np.array([index, 1])}, "go")
        writer.save_episode({})
    path = Layout(root).data(0)
    table = pq.read_table(path)
    place = table.schema.get_field_index("counts")
    gap = pa.array([[1, None], *[[1, 2]] * (len(table) - 1)], table.schema.field(place).type)
    pq.write_table(table.set_column(place, "counts", gap), path)
    with pytest.raises(HandrailError, match="some rows without a value, expected int64"):
        read_frames(root, 0)


def test_no_bit_of_a_line_of_metadata_is_taken_for_another(tmp_path):
    root = record(tmp_path / "set", 3, features=TINY_FEATURES)
    merge_datasets([root], root)
    path, wanted = Layout(root).row(0), read_episodes(root)
    whole = path.read_bytes()
    pages = len(whole) - 8 - pq.read_metadata(path).serialized_size
    for place in range(4, pages, 29):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        for read in (lambda: read_episodes(root), lambda: list(EpisodeRows.read(path).rows)):
            try:
                assert read() == wanted
            except (HandrailError, OSError, ValueError):
                continue


@pytest.mark.parametrize("of", ["meta/tasks.parquet", "meta/episodes/chunk-000/file-000.parquet"])
def test_another_file_under_the_name_of_one_of_rows_is_one_line(root, of):
    shutil.copyfile(root / of, Layout(root).data(0))
    with pytest.raises(HandrailError, match=r"\A[^\n]*\Z"):
        read_frames(root, 0)
    assert "episode 0: data/" in check_report(root)[0]


def test_a_copy_of_a_data_file_which_lerobot_would_read_is_refused(root):
    data = Layout(root).data(0)
    shutil.copy(data, data.with_name("file-000 (1).parquet"))
    with pytest.raises(HandrailError, match=r"file-000 \(1\).parquet; handrail-edit repair .* moves them"):
        check_whole(root)
    repair(root)
    check_whole(root)


def test_a_bit_of_a_video_that_still_decodes_is_damage(tmp_path):
    root = record(tmp_path / "set", 4, cameras=True)
    merge_datasets([root], root)
    video = min(root.glob("videos/*/*/*.mp4"))
    whole = video.read_bytes()
    end = whole.index(b"mdat") + 4
    place = whole.index(b"x264", end)  # a comment of the encoder
    video.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
    with pytest.raises(HandrailError, match=r"4 of 4 episodes .* has other content"):
        check_whole(root)
