"""No cell of a table is run by a spreadsheet, and numbers stay numbers."""

import csv
import io
import json

import numpy as np
import pytest
from canned import canned
from command_helpers import command
from compare_helpers import quick_and_slow

from handrail.datasets.storage.atomic import publish_folder, write_whole
from handrail.datasets.storage.csv_file import csv_text
from handrail.policies.imitation.training.curve import COLUMNS, Curve, read_curve

HARMFUL = [
    "=1+2",
    "+cmd|' /C calc'!A0",
    "-2+3",
    "@SUM(A1)",
    "\t=1",
    "\r=1",
    "\n=1",
    " =1",
    "＝1",
    "=HYPERLINK()",
]


@pytest.mark.parametrize("text", HARMFUL)
def test_formulas_are_defused(text):
    rows = list(csv.reader(io.StringIO(csv_text([{text: text, "b": 1}]), newline="")))
    defused = "'" + text.replace("\r", " ")
    assert rows == [[defused, "b"], [defused, "1"]]


@pytest.mark.parametrize("value", [-1.5, 3, "-1.5", "+2e-3", "-0", None, True, "a-b", "x=1", ""])
def test_harmless_values_stay(value):
    row = list(csv.reader(io.StringIO(csv_text([{"a": value, "b": 0}]))))[1]
    assert row == ["" if value is None else str(value), "0"]


def test_a_report_has_no_formula(tmp_path):
    sets = canned(quick_and_slow)
    words = ("--output", tmp_path / "out", "--no_pictures", "--labels", "=cmd|' /C calc'!A0", "b")
    assert command(sets / "quick", sets / "slow", *words, name="compare").returncode == 0
    for name in ("episodes.csv", "differences.csv"):
        rows = list(csv.DictReader(io.StringIO((tmp_path / "out" / name).read_text())))
        assert rows
        assert any(value.startswith("'=cmd") for row in rows for value in row.values())
        assert not any(value.startswith(("=", "@")) for row in rows for value in row.values())
        assert any(value.startswith("-") for row in rows for value in row.values())  # numbers below 0
    json.loads((tmp_path / "out" / "report.json").read_bytes(), parse_constant=pytest.fail)


def _row(step):
    return dict.fromkeys(COLUMNS, 0.5) | {"step": step}


@pytest.mark.parametrize("torn", ["3,0.5,0.5", "3,0.5,0.5,0.5,0.5,0", "3,0.5,0.5,0.5,0.5,1e", "\xff,,,,,\n"])
def test_a_curve_survives_a_torn_line(tmp_path, torn):
    for step in (1, 2):
        Curve(tmp_path, step - 1).add(_row(step))
    with open(tmp_path / "curve.csv", "a") as file:
        file.write(torn)
    assert [row["step"] for row in read_curve(tmp_path)] == [1, 2]
    curve = Curve(tmp_path, 2)
    curve.add(_row(3))
    assert [row["step"] for row in read_curve(tmp_path)] == [1, 2, 3]
    assert np.isclose(read_curve(tmp_path)[2]["loss"], 0.5)


def test_a_curve_is_never_half_there(tmp_path, monkeypatch):
    """Begun anew, a training that is killed before the new curve is whole keeps the old one."""
    Curve(tmp_path, 0).add(_row(1))

    def die(*_):
        raise OSError("no space left")

    monkeypatch.setattr("os.replace", die)
    with pytest.raises(OSError, match="no space"):
        Curve(tmp_path, 1)
    assert [row["step"] for row in read_curve(tmp_path)] == [1]


def test_a_published_folder_is_on_the_disk(tmp_path, monkeypatch):
    synced = []
    real = __import__("os").fsync
    monkeypatch.setattr("os.fsync", lambda number: synced.append(number) or real(number))
    write_whole(tmp_path / "draft" / "model" / "weights", b"w")
    (tmp_path / "final").mkdir()
    (tmp_path / "final" / "old").touch()
    synced.clear()
    publish_folder(tmp_path / "draft", tmp_path / "final")
    assert len(synced) == 4  # two folders, the file, and the folder above
    assert [path.name for path in tmp_path.rglob("*")] == ["final", "model", "weights"]
