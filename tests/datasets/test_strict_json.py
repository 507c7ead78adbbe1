"""JSON from a stranger is refused with one line: deep, huge, not finite, not a file."""

import json
import os

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from canned import copied
from command_helpers import command, refused
from datasets_helpers import create, record

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.evaluations import read_evaluations
from handrail.datasets.format.info_file import check_pattern, fill
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.schema import Feature
from handrail.datasets.quality.measure import measure
from handrail.datasets.quality.summary import summarize
from handrail.datasets.reading.load import read_demonstrations
from handrail.datasets.reading.reader import read_episodes, read_frames, read_info
from handrail.datasets.storage.strict_json import MOST_BYTES, MOST_DEPTH, parse_json, read_json
from handrail.policies.imitation.interface.checkpoint import read_meta

DEEP = b"[" * 100_000 + b"]" * 100_000
HUGE = b'{"pad": "' + b"x" * MOST_BYTES + b'"}'
BAD = {
    "deep": DEEP,
    "a bit deep": b"[" * (MOST_DEPTH + 1) + b"]" * (MOST_DEPTH + 1),
    "huge": HUGE,
    "NaN": b'{"mean": NaN}',
    "infinity": b'{"max": -Infinity}',
    "too large for a float": b'{"max": 1e999}',
    "400 digits": b'{"seed": ' + b"9" * 400 + b"}",
    "no text": b'{"robot": "\\ud800"}',
    "torn": b'{"robot": "te',
    "binary": b"\xff\xfe\x00\x9f",
}


@pytest.fixture
def root(tmp_path):
    return copied(tmp_path / "set", record, 2)


def test_plain_json_is_read():
    content = {"a": [1, 2.5, None, True, {"b": "ä"}], "seed": 2**63}
    assert parse_json(json.dumps(content).encode()) == content
    assert parse_json(b"[" * MOST_DEPTH + b"]" * MOST_DEPTH)[0]


@pytest.mark.parametrize("name", BAD)
def test_bad_json_is_refused_whatever_it_should_be(name, tmp_path):
    with pytest.raises(ValueError, match=r"\A[^\n]{1,300}\Z"):
        parse_json(BAD[name])
    (tmp_path / "huge").write_bytes(HUGE)
    with pytest.raises(ValueError, match="at most 16 MB"):
        read_json(tmp_path / "huge")


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "info.json")
    with pytest.raises(OSError, match="found a named pipe"):
        read_json(tmp_path / "info.json")


@pytest.mark.parametrize("name", BAD)
@pytest.mark.parametrize("place", ["info", "manifest"])
def test_a_dataset_says_so_in_one_line(root, name, place):
    getattr(Layout(root), place).write_bytes(BAD[name])
    done = command("--dataset.root", root, name="inspect")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
    assert len(done.stderr) < 600


@pytest.mark.parametrize("name", BAD)
def test_evaluations_and_policies_say_so_in_one_line(tmp_path, name):
    (tmp_path / "handrail.json").write_bytes(BAD[name])
    for action in (
        lambda: read_evaluations([tmp_path / "handrail.json"]),
        lambda: read_meta(tmp_path),
    ):
        with pytest.raises(HandrailError, match=r"\A[^\n]{1,400}\Z"):
            action()


def _spoil(root, change):
    path = Layout(root).info
    path.write_text(json.dumps(json.loads(path.read_bytes()) | change))


def _redescribe(root, name, **entries):
    described = json.loads(Layout(root).info.read_bytes())["features"]
    described[name] |= entries
    _spoil(root, {"features": described})


@pytest.mark.parametrize(
    "change",
    [
        {"data_path": "{chunk_index.__class__}"},
        {"data_path": "{chunk_index:02000000000d}"},
        {"data_path": "{chunk_index:{file_index}d}"},
        {"data_path": "{chunk_index!r}"},
        {"data_path": "{video_key}/x.parquet"},
        {"data_path": "{"},
        {"data_path": "../../other/file-{file_index:03d}.parquet"},
        {"data_path": "/etc/passwd"},
        {"data_path": "data/\0.parquet"},
        {"data_path": 3},
        {"video_path": "{video_key.__init__.__globals__}"},
        {"fps": 0},
        {"fps": "thirty"},
        {"fps": 1e300},
        {"total_episodes": 10**18},
        {"total_episodes": -1},
        {"total_frames": 1.5},
        {"features": []},
        {"features": {"action": 3}},
        {"features": {"action": {"dtype": "float32", "shape": [10**9, 10**9], "names": None}}},
        {"features": {"action": {"dtype": "float32", "shape": ["a"], "names": None}}},
        {"features": {"action": {"dtype": {"$": 1}, "shape": [1], "names": None}}},
        {"robot_type": ["a"]},
        {"codebase_version": "v" + "9" * 5000},
    ],
    ids=lambda change: f"{next(iter(change))} {str(next(iter(change.values())))[:30]!r}",
)
def test_info_is_not_trusted(root, change):
    _spoil(root, change)
    with pytest.raises(HandrailError, match=r"\A[^\n]{1,500}\Z"):
        read_info(root)


def test_a_type_that_numpy_would_make_room_for_is_not_read(root):
    """`V1000000000` is a type of numpy's; a column of it would be a gigabyte a number."""
    _redescribe(root, "action", dtype="V1000000000")
    done = command("--dataset.root", root, name="inspect")
    assert done.returncode in (0, 2)
    assert "Traceback" not in done.stderr
    with pytest.raises(HandrailError, match=r"\A[^\n]*unknown column[^\n]*'action'[^\n]*\Z"):
        read_frames(root, 0, ["action"])


def test_a_camera_cannot_lead_out_of_the_dataset():
    pattern = "videos/{video_key}/file-{file_index:03d}.mp4"
    check_pattern(pattern, ("video_key", "file_index"))
    assert fill(pattern, 0, 7, "front") == "videos/front/file-007.mp4"
    for key in ("../../secret", "..", "a/../../b", "..\\up"):
        with pytest.raises(ValueError, match="inside the dataset"):
            fill(pattern, 0, 0, key)


@pytest.mark.parametrize("column", ["episode_index", "length", "data/chunk_index", "data/file_index"])
@pytest.mark.parametrize("harm", ["gone", "text", "negative", "empty"])
def test_a_line_of_metadata_is_not_trusted(root, column, harm):
    path = Layout(root).row(1)
    table, place = pq.read_table(path), pq.read_schema(path).names.index(column)
    changed = {"text": pa.array(["../.."]), "negative": pa.array([-1]), "empty": pa.array([None], pa.int64())}
    gone = harm == "gone"
    table = table.remove_column(place) if gone else table.set_column(place, column, changed[harm])
    pq.write_table(table, path)
    with pytest.raises(HandrailError, match=r"\A[^\n]{1,500}\Z"):
        read_episodes(root)


@pytest.mark.parametrize("tasks", [["go"], [[1, 2]], [[None]]])
def test_tasks_that_are_no_texts_are_one_line(root, tasks):
    path = Layout(root).row(1)
    table = pq.read_table(path)
    pq.write_table(table.set_column(table.schema.names.index("tasks"), "tasks", pa.array(tasks)), path)
    with pytest.raises(HandrailError, match=r"\A[^\n]{1,400}\$\.tasks[^\n]{1,100}\Z"):
        summarize(root)


def test_tasks_may_be_missing(root):
    pq.write_table(pq.read_table(Layout(root).row(1)).drop_columns(["tasks"]), Layout(root).row(1))
    assert [row["tasks"] for row in read_episodes(root)][1] == []


@pytest.mark.parametrize("names", [["tool.z"], [f"{axis}.pos" for axis in "abcd"] + ["x", "y", "z"]])
def test_names_of_something_else_are_no_names(root, names):
    """Half of the readers would look beyond the numbers for the tool."""
    _redescribe(root, "observation.state", names=names)
    assert read_info(root).features["observation.state"].names is None
    assert len(summarize(root)) == 2


@pytest.mark.parametrize("shape", [[], [1], [2, 2], [100]])
def test_a_column_of_another_shape_is_one_line(root, shape):
    _redescribe(root, "observation.state", shape=shape, names=["a.pos"])
    with pytest.raises(HandrailError, match=r"\A[^\n]{1,500}\Z"):
        read_frames(root, 0)


@pytest.mark.parametrize("name", ["safety.contacts", "controller.smallest_distance", "teleop.mode"])
def test_a_column_of_another_type_is_as_if_missing(tmp_path, name):
    """Any tool may have named a column so."""
    kind = Feature("float32", (3,)) if name == "teleop.mode" else Feature("string")
    with create(tmp_path / "set", features={"action": Feature("float32", (2,)), name: kind}) as writer:
        for _ in range(8):
            value = np.zeros(3, np.float32) if name == "teleop.mode" else "near"
            writer.add_frame({"action": np.zeros(2, np.float32), name: value}, "go")
        writer.save_episode({"success": True})
    (seen,) = summarize(tmp_path / "set")
    assert (seen.contacts, seen.smallest_distance, seen.mode) == (None, None, None)
    found = measure({"a": read_demonstrations(tmp_path / "set")}, np.random.default_rng(0))
    assert not found.values["contacts"]["a"].known.size


def test_a_newer_format_is_refused_on_reading(root):
    path = Layout(root).manifest
    path.write_text(json.dumps(json.loads(path.read_bytes()) | {"format": 99}))
    refused("--dataset.root", root, name="inspect", told="a newer Handrail wrote it")
