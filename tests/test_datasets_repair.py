"""Repair keeps the longest run of complete episodes, rebuilds the rest, deletes nothing that was saved."""

import json
import os
import shutil

import numpy as np
import pytest
from datasets_helpers import (
    CAMERAS,
    FPS,
    create,
    digest,
    files_of,
    frame_of,
    length_of,
    open_with_lerobot,
    record,
    record_one,
    resume,
    tree,
)

from handrail.controllers.errors import HandrailError
from handrail.datasets.layout import Layout
from handrail.datasets.repair import repair


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    return record(tmp_path_factory.mktemp("repair") / "set", 4, cameras=True)


@pytest.fixture
def root(original, tmp_path):
    return shutil.copytree(original, tmp_path / "set")


def _flip_a_byte(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 0xFF
    path.write_bytes(content)


def test_a_whole_dataset_is_left_alone(root):
    before = tree(root)
    report = repair(root)
    assert report.clean
    assert report.episodes == 4
    assert str(report).endswith("nothing to repair")
    assert tree(root) == before


@pytest.mark.parametrize("name", ["info", "stats", "tasks"])
@pytest.mark.parametrize("content", [None, b"", b'{"total_episodes": 4, "feat', b"[1, 2]"])
def test_summary_files_are_rebuilt_to_the_byte(root, name, content):
    before, path = tree(root), getattr(Layout(root), name)
    path.unlink()
    if content is not None:
        path.write_bytes(content)
    report = repair(root)
    assert report.rebuilt == (path.relative_to(root).as_posix(),)
    assert not report.moved
    assert tree(root) == before
    assert repair(root).clean


def test_resume_repairs_torn_files_by_itself(root):
    Layout(root).info.write_bytes(b"{")
    Layout(root).stats.unlink()
    Layout(root).tasks.unlink()
    with resume(root, cameras=True) as writer:
        assert record_one(writer, cameras=True) == 4
    assert open_with_lerobot(root).num_episodes == 5
    assert repair(root).clean


@pytest.mark.parametrize("stream", range(4), ids=["data", "line", "wrist", "scene"])
@pytest.mark.parametrize("harm", ["cut", "empty", "gone", "flipped"])
def test_a_damaged_episode_ends_the_run_and_is_set_aside(root, stream, harm):
    path = files_of(root, 1, cameras=True)[stream]
    if harm == "gone":
        path.unlink()
    elif harm == "flipped":
        _flip_a_byte(path)
    else:
        os.truncate(path, path.stat().st_size // 2 if harm == "cut" else 0)
    first = digest(root, 0, cameras=True)
    saved = [p for episode in (1, 2, 3) for p in files_of(root, episode, cameras=True) if p.exists()]
    contents = sorted(p.read_bytes() for p in saved)
    report = repair(root)
    if stream == 1 and harm == "flipped" and report.episodes == 4:
        return  # the byte was one that nothing depends on
    assert report.episodes == 1
    assert report.frames == length_of(0)
    assert path.relative_to(root).as_posix() in report.damage
    assert sorted(p.read_bytes() for p in (root / ".damaged").rglob("*.*") if p.is_file()) == contents
    assert not report.removed
    assert digest(root, 0, cameras=True) == first
    assert repair(root).clean
    with resume(root, cameras=True) as writer:
        assert record_one(writer, cameras=True) == 1
    dataset = open_with_lerobot(root)
    assert (dataset.num_episodes, len(dataset)) == (2, length_of(0) + length_of(1))
    assert dataset.meta.stats["index"]["count"].tolist() == [len(dataset)]


def test_leftovers_of_a_save_that_was_never_committed_are_removed(root):
    layout, donor = Layout(root), files_of(root, 3, cameras=True)
    shutil.copy(donor[0], layout.data(4))
    shutil.copy(donor[2], layout.video(CAMERAS[0], 4))
    layout.staging.mkdir()
    (layout.staging / "data.parquet").write_bytes(b"PAR1 and no footer")
    report = repair(root)
    assert report.episodes == 4
    assert sorted(report.removed) == sorted(
        [
            ".handrail/data.parquet",
            layout.relative(layout.data(4)),
            layout.relative(layout.video(CAMERAS[0], 4)),
        ]
    )
    assert not report.moved
    assert not report.damage
    assert not layout.data(4).exists()


def test_lost_lines_of_metadata_never_cost_data(root):
    """If the lines of saved episodes vanish, their files are no leftovers of a crash."""
    before = {content for path, content in tree(root).items() if path.startswith(("data", "videos"))}
    shutil.rmtree(root / "meta" / "episodes")
    Layout(root).info.unlink()
    report = repair(root)
    assert report.episodes == 0
    assert "is missing" in report.damage
    assert before <= set(tree(root / ".damaged").values())
    assert not report.removed


def test_the_last_line_gone_is_noticed_by_the_count(root):
    Layout(root).row(3).unlink()
    report = repair(root)
    assert "info.json counts 4 episodes" in report.damage
    assert not report.removed
    assert len(report.moved) == 3


def test_a_stray_file_that_lerobot_would_read_is_set_aside(root):
    stray = root / "data" / "chunk-000" / "copy of file-000.parquet"
    shutil.copy(Layout(root).data(0), stray)
    report = repair(root)
    assert report.episodes == 4
    assert report.moved == (stray.relative_to(root).as_posix(),)
    assert open_with_lerobot(root).num_episodes == 4


def test_a_dataset_with_no_episode(tmp_path):
    create(tmp_path / "set").close()
    assert repair(tmp_path / "set").clean
    Layout(tmp_path / "set").info.unlink()
    assert repair(tmp_path / "set").rebuilt == ("meta/info.json",)
    assert json.loads(Layout(tmp_path / "set").info.read_bytes())["total_episodes"] == 0


def test_episodes_of_another_tool_are_not_touched(tmp_path):
    root = record(tmp_path / "set", 2)
    import pyarrow.parquet as pq

    layout = Layout(root)
    pq.write_table(pq.read_table(layout.row(1)).replace_schema_metadata(None), layout.row(2))
    before = tree(root)
    for attempt in (lambda: repair(root), lambda: resume(root)):
        with pytest.raises(HandrailError, match="written by another tool"):
            attempt()
        assert tree(root) == before


def test_chunks_roll_over(tmp_path, monkeypatch):
    from handrail.datasets import layout, metadata

    monkeypatch.setattr(layout, "FILES_IN_A_CHUNK", 3)
    monkeypatch.setattr(metadata, "FILES_IN_A_CHUNK", 3)
    root = record(tmp_path / "set", 5)
    with resume(root) as writer:
        for _ in range(3):
            record_one(writer, cameras=False)
    assert sorted(path.name for path in (root / "data").iterdir()) == ["chunk-000", "chunk-001", "chunk-002"]
    assert repair(root).clean
    dataset = open_with_lerobot(root)
    assert dataset.num_episodes == 8
    assert dataset[len(dataset) - 1]["timestamp"].item() == pytest.approx((length_of(7) - 1) / FPS)
    last = frame_of(7, length_of(7) - 1, cameras=False)["action"]
    assert np.array_equal(dataset[len(dataset) - 1]["action"].numpy(), last)
