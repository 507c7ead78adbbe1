"""Laws of the soak: it sees what is lost or changed, and a short one finds nothing lost."""

import json
import shutil
import subprocess
import sys

import pytest
from datasets_helpers import record

from handrail.controllers.errors import HandrailError
from handrail.datasets.editing.merge import merge_datasets
from handrail.scripts.bench.soak import whole


def test_a_digest_stays_when_packed_and_moved_and_not_when_a_row_or_a_picture_differs(tmp_path):
    few, many = record(tmp_path / "few", 2, cameras=True), record(tmp_path / "many", 3, cameras=True)
    packed, twice = tmp_path / "packed", tmp_path / "twice"
    merge_datasets([many], packed)
    merge_datasets([few, many], twice)
    found = whole.saved_in(many)
    assert len(set(found.values())) == 3
    assert whole.saved_in(packed) == found
    moved = whole.saved_in(twice)
    assert moved == {**whole.saved_in(few), **{2 + number: found[number] for number in found}}
    shutil.copy(*(root / "data/chunk-000/file-000.parquet" for root in (few, many)))
    assert whole.saved_in(many) == found  # the same rows, written by another
    video = "videos/observation.images.wrist/chunk-000/file-00{}.mp4"
    shutil.copy(many / video.format(0), many / video.format(1))
    with pytest.raises(HandrailError, match="pictures"):
        whole.saved_in(many)


def test_shards_count_as_what_they_will_be(tmp_path):
    root = record(tmp_path / "d", 2)
    record(tmp_path / ".d.shards" / "shard-0000002", 1)
    assert whole.saved_by(root) == {**whole.saved_in(root), 2: whole.saved_in(root)[0]}
    assert whole.lines_of(root) == 3


@pytest.mark.slow
def test_faults_cost_nothing_saved(tmp_path):
    for fault in ("SIGKILL of the command", "Ctrl-C"):
        words = [
            *(sys.executable, "-m", "handrail.scripts.bench", "soak"),
            tmp_path,
            "--rounds",
            1,
            "--work",
            "record",
            "--fault",
            fault,
        ]
        subprocess.run([*map(str, words)], check=True, capture_output=True)
    rows = [json.loads(line) for line in (tmp_path / "rounds.jsonl").read_text().splitlines()]
    assert [row["round"] for row in rows] == [0, 1]
    assert [row.get("complaints") for row in rows] == [[], []]
    assert [row["lost"] for row in rows] == [0, 0]
