"""A dataset made to do harm does none: nothing outside its folder is touched, nothing hangs."""

import json
import shutil

import pyarrow.parquet as pq
import pytest
from datasets_helpers import create, record, resume, tree

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.metadata import FileSeal
from handrail.datasets.recording.repair import repair


@pytest.fixture
def root(tmp_path):
    return record(tmp_path / "set", 4, cameras=True)


@pytest.mark.parametrize("name", [".handrail", ".damaged", "data", "meta/episodes", "videos"])
def test_nothing_is_written_or_removed_through_a_link(root, name):
    home = root.parent / "home"
    home.mkdir()
    (home / "thesis.tex").write_text("mine")
    if (root / name).exists():
        shutil.rmtree(root / name)
    (root / name).symlink_to(home)
    before = tree(root.parent)
    for action in (
        lambda: repair(root, set_aside_damaged=True),
        lambda: resume(root, cameras=True),
        lambda: create(root, cameras=True, overwrite=True),
    ):
        with pytest.raises(HandrailError, match=f"found a link at {name}"):
            action()
    assert tree(root.parent) == before


def test_a_line_cannot_name_files_outside(root):
    layout = Layout(root)
    secret = root.parent / "secret"
    secret.write_text("mine")
    path, name = layout.row(1), "../../../secret"
    (root / ".damaged" / "000").mkdir(parents=True)
    seals = json.dumps({name: [4, FileSeal.of(secret).sha256]})
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
