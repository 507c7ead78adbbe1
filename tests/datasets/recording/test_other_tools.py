"""What other tools do to a dataset is no damage; what repair and `--resume` do is said in one line."""

import json
import os
import warnings

import pyarrow.parquet as pq
from command_helpers import command, ran
from datasets_helpers import (
    CAMERAS,
    check_pictures,
    fails,
    open_with_lerobot,
    record,
    record_one,
    resume,
)

from handrail.datasets.editing.config import TrimConfig
from handrail.datasets.editing.edit import edit
from handrail.datasets.editing.merge import merge_datasets
from handrail.datasets.format.layout import Layout
from handrail.datasets.reading.check import check_whole
from handrail.datasets.reading.reader import read_episodes
from handrail.datasets.recording.repair import repair


def test_videos_that_lerobot_encoded_anew_are_whole(root):
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
    assert checked.stdout.count("of like content") == 8
    done = command(root, name="edit repair")
    assert done.returncode == 0
    assert "another tool" in done.stdout
    ran("--dataset.root", root, "--check", name="inspect")
    assert repair(root).clean
    check_pictures(open_with_lerobot(root), range(len(open_with_lerobot(root))))


def test_episodes_of_another_tool_are_not_touched(tmp_path):
    root = record(tmp_path / "set", 2)
    layout = Layout(root)
    pq.write_table(pq.read_table(layout.row(1)).replace_schema_metadata(None), layout.row(2))
    for attempt in (lambda: repair(root), lambda: resume(root)):
        fails(attempt, "written by another tool", unchanged=root)


def test_what_lerobot_encodes_by_default_is_edited_and_repaired(root):
    """LeRobot's decoder of AV1 has another name than its encoder."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from lerobot.configs import RGBEncoderConfig
        from lerobot.datasets.dataset_tools import reencode_dataset

        reencode_dataset(open_with_lerobot(root), RGBEncoderConfig())
    edit(TrimConfig(folder=str(root), output=str(root.with_name("trimmed"))))
    merge_datasets([root], root.with_name("packed"))
    assert [len(read_episodes(root.with_name(name))) for name in ("trimmed", "packed")] == [4, 4]
    os.truncate(Layout(root).data(3), 30)
    assert repair(root, set_aside_damaged=True).episodes == 3
    for each in (root, root.with_name("packed")):
        found = open_with_lerobot(each)
        check_pictures(found, range(len(found)))


def test_rows_that_another_tool_wrote_are_taken_only_when_told_to(tmp_path):
    """Numbers in another order have the same statistics."""
    root = record(tmp_path / "set", 2)
    path = Layout(root).data(1)
    table = pq.read_table(path)
    place = table.column_names.index("action")
    pq.write_table(table.set_column(place, table.field(place), table["action"][::-1]), path)
    name = path.relative_to(root).as_posix()
    for attempt in (lambda: check_whole(root), lambda: resume(root)):
        fails(attempt, f"another tool wrote {name} anew", "handrail-edit repair", unchanged=root)
    repair(root)
    check_whole(root)
