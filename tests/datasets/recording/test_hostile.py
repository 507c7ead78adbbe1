"""A dataset made to do harm does none: nothing outside its folder is touched, nothing hangs."""

import contextlib
import json
import os
import shutil
import signal
import socket

import pyarrow.parquet as pq
import pytest
from canned import canned
from command_helpers import command
from datasets_helpers import create, fails, record, resume, tree

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.metadata import Checksum
from handrail.datasets.recording.repair import repair

COMMANDS = (
    ("inspect",),
    ("inspect", "--check"),
    ("pack", "--output", "{new}"),
    ("repair",),
)


@pytest.mark.parametrize("name", [".handrail", ".damaged", "data", "meta/episodes", "videos"])
def test_nothing_is_written_or_removed_through_a_link(root, name):
    home = root.parent / "home"
    home.mkdir()
    (home / "thesis.tex").write_text("mine")
    if (root / name).exists():
        shutil.rmtree(root / name)
    (root / name).symlink_to(home)
    for action in (
        lambda: repair(root, set_aside_damaged=True),
        lambda: resume(root, cameras=True),
        lambda: create(root, cameras=True, overwrite=True),
    ):
        fails(action, f"found a link at {name}", unchanged=root.parent)


def test_a_line_cannot_name_files_outside(root):
    layout = Layout(root)
    secret = root.parent / "secret"
    secret.write_text("mine")
    path, name = layout.row(1), "../../../secret"
    (root / ".damaged" / "000").mkdir(parents=True)
    seals = json.dumps({name: [4, Checksum.of(secret).sha256]})
    pq.write_table(pq.read_table(path).replace_schema_metadata({"handrail": seals}), path)
    assert "inside the dataset" in str(repair(root))
    assert "inside the dataset" in str(repair(root, set_aside_damaged=True))
    assert secret.read_text() == "mine"


@pytest.mark.parametrize("name", ["data/chunk-99999999", "meta/episodes/chunk-99999"])
def test_a_made_up_number_is_no_endless_search(root, name):
    path = root / name / "file-001.parquet"
    path.parent.mkdir(parents=True)
    path.write_bytes(b"x")
    with pytest.raises(HandrailError, match="move it away"):
        repair(root)


@pytest.mark.parametrize("column", ["length", "tasks", "stats/action/mean", "stats/action/count"])
def test_a_line_with_other_columns_is_damage_not_a_traceback(root, column):
    path = Layout(root).row(2)
    table = pq.read_table(path)
    pq.write_table(table.drop_columns([column]), path)
    assert "episode 2" in repair(root).damage[0]


def named_pipe(path):
    os.mkfifo(path)


def listening(path):
    with socket.socket(socket.AF_UNIX) as line, contextlib.chdir(path.parent):
        line.bind(path.name)


def endless(path):
    path.symlink_to("/dev/zero")


def itself(path):
    path.symlink_to(path.name)


@pytest.mark.parametrize("put", [named_pipe, listening, endless, itself])
def test_a_special_file_is_one_line_wherever_it_lies(put, tmp_path):
    """Law: whatever file of a dataset it stands for, no command waits for it or reads without end."""
    root = canned(record, 2, cameras=True)
    before = signal.signal(signal.SIGALRM, lambda *_: pytest.fail("it hangs"))
    signal.alarm(240)
    try:
        for number, name in enumerate([*tree(root), "README.md", ".handrail/lock"]):
            copy = shutil.copytree(root, tmp_path / str(number))
            (copy / name).unlink(missing_ok=True)
            (copy / name).parent.mkdir(exist_ok=True)
            put(copy / name)
            new = tmp_path / "new"
            said = [
                command(copy, *(word.format(new=new) for word in words), name=verb)
                for verb, *words in COMMANDS
            ]
            assert not any("got one in use" in done.stderr for done in said)
            assert all(done.returncode in (0, 1, 2) for done in said)
            assert all(done.stderr.count("\n") <= 1 for done in said), said
            if name.startswith(("data", "videos", "meta/episodes")):
                assert {done.returncode for done in said[1:]} <= {1, 2}, (name, said)
            shutil.rmtree(copy)
            shutil.rmtree(new, ignore_errors=True)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
