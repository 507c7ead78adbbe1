"""Damage is noticed before a dataset is used: cheaply where nothing has changed, fully when asked."""

import json
import os

import numpy as np
import pytest
from canned import copied
from command_helpers import command, ran, refused
from compare_helpers import JOINTS, lerobot_dataset, quick_and_slow
from datasets_helpers import record, tree

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.metadata import Checksum
from handrail.datasets.reading.check import check_report, check_whole
from handrail.datasets.recording import checksums
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
    for content in (b"{", b"[]", b'{"data/chunk-000/file-000.parquet": 3}', b"\xff" * 9):
        for path in checksums.memory_folder().iterdir():
            path.write_bytes(content)
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
    next(root.glob("videos/*/*/*.mp4")).unlink()
    with pytest.raises(HandrailError, match=r"copied in part: .* files are missing \(videos/"):
        check_whole(root)
    assert len(check_report(root)) == 1
    next(root.glob("data/*/*.parquet")).unlink()
    done = command("--dataset.root", root, "--check", name="inspect")
    assert done.returncode == 1
    assert "episode 5" in done.stdout


def test_what_lerobot_adds_is_read_and_checked(tmp_path):
    """A dataset that LeRobot has recorded on has lines without checksums: it is read, but not resumed."""
    root = record(tmp_path / "set", 2)
    import pyarrow.parquet as pq

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
