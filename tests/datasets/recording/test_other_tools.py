"""What other tools do to a dataset is no damage; what repair and `--resume` do is said in one line."""

import json
import warnings

import numpy as np
import pytest
from command_helpers import command, ran
from datasets_helpers import (
    CAMERAS,
    check_pictures,
    create,
    frame_of,
    length_of,
    open_with_lerobot,
    record,
    record_one,
    resume,
    tree,
)

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.recording.repair import repair


def test_what_lerobot_encoded_anew_is_whole(root):
    """The first version set aside every episode of a dataset after `lerobot-edit-dataset reencode_videos`."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from lerobot.configs import RGBEncoderConfig
        from lerobot.datasets.dataset_tools import reencode_dataset

        reencode_dataset(open_with_lerobot(root), RGBEncoderConfig(vcodec="h264", crf=35, g=4))
    info = json.loads(Layout(root).info.read_bytes())["features"][CAMERAS[0]]["info"]
    assert info["video.crf"] == 35
    with resume(root, cameras=True) as writer:
        assert "whole, but as another tool wrote them: videos/" in str(writer.repaired)
        assert record_one(writer, cameras=True) == 4
    assert json.loads(Layout(root).info.read_bytes())["features"][CAMERAS[0]]["info"] == info
    checked = command("--dataset.root", root, "--check", name="inspect")
    assert checked.stdout.count("but the right frames") == 8
    done = command(root, name="edit repair")
    assert done.returncode == 0
    assert "another tool" in done.stdout
    ran("--dataset.root", root, "--check", name="inspect")
    assert repair(root).clean
    check_pictures(open_with_lerobot(root), range(len(open_with_lerobot(root))))


def test_statistics_that_lerobot_computed_anew_are_replaced(tmp_path):
    """Its `recompute_stats` writes NaN and Infinity, which is no JSON, where a column is not finite."""
    with create(tmp_path / "set") as writer:
        for index in range(12):
            frame = frame_of(0, index, cameras=False)
            writer.add_frame(frame | {"controller.solve_time": np.inf if index % 2 else 0.1}, "wait")
        writer.save_episode({"success": True, "failure_reason": None, "seed": 0})
    path = Layout(tmp_path / "set").stats
    ours = path.read_bytes()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from lerobot.datasets.dataset_tools import recompute_stats

        recompute_stats(open_with_lerobot(tmp_path / "set"))
    assert b"NaN" in path.read_bytes() or b"Infinity" in path.read_bytes()
    said = command("--dataset.root", tmp_path / "set", "--check", name="inspect").stdout
    assert "stats.json: JSON is malformed" in said
    with resume(tmp_path / "set") as writer:
        assert path.read_bytes() == ours
        record_one(writer, cameras=False)
    text = path.read_text()
    assert "NaN" not in text
    assert "Infinity" not in text
    assert json.loads(text)["index"]["count"] == [12 + length_of(1)]


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
