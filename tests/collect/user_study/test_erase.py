"""Laws of what comes of a study: erased is erased, tables explain themselves, nobody is made up."""

import bisect
import json
import random
import shutil

import pytest
from datasets_guillotine import Guillotine
from datasets_helpers import keep_files
from user_study_helpers import erased, session, study_folder, table, trials, wanted

from handrail.collect.user_study.exports import COLUMNS
from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.scores import DEMO
from handrail.datasets.reading.check import check_report

GUILLOTINE = Guillotine()


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    folder = study_folder(tmp_path_factory.mktemp("two"), forms=["sus", "questions"])
    for name in ("P001", "P002"):
        session(folder, name)
    return folder


def texts(root):
    return {path: path.read_bytes() for path in root.rglob("*") if path.is_file()}


def check_only_the_other_is_left(folder):
    assert trials(folder) == wanted(folder, "P002")
    assert list(folder.participants()) == ["P002"]
    for path, content in texts(folder.root).items():
        assert b"P001" not in content, path
        assert "P001" not in str(path.relative_to(folder.root))
    for _, _, root in folder.conditions:
        assert not check_report(root)
    assert {row["participant"] for name in COLUMNS for row in table(folder, name)} == {"P002"}


def test_erasing_leaves_nothing_of_a_participant_and_all_of_the_others(two, tmp_path):
    shutil.copytree(two.root, tmp_path / "study")
    folder = type(two)(tmp_path / "study")
    answers = json.loads((folder.root / "participants" / "P002" / "answers.json").read_text())
    said = erased(folder, "P001")
    assert "erased P001: 25 answers, 2 trials of practice" in said
    assert "1 of data/reach/ee" in said
    check_only_the_other_is_left(folder)
    assert json.loads((folder.root / "participants" / "P002" / "answers.json").read_text()) == answers
    with pytest.raises(HandrailError, match="unknown participant 'P001': expected one of P002"):
        erased(folder, "P001")
    erased(folder, "P002")
    assert not list(folder.root.rglob("*.parquet"))


def erased_in_two_goes(two, root, k):
    shutil.copytree(two.root, root)
    folder = type(two)(root)
    lived = GUILLOTINE.run(root, k, lambda: erased(folder, "P001"))
    if "P001" in folder.participants():
        if folder.participant("P001").session.erasing:
            with pytest.raises(HandrailError, match="is being erased"):
                session(folder, "P001")
        erased(folder, "P001")
    session(folder, "P002")
    check_only_the_other_is_left(folder)
    return lived


def test_an_erasure_that_is_killed_is_finished_by_the_next(two, tmp_path):
    for k in random.Random(1).sample(range(1, 100), 3):
        erased_in_two_goes(two, tmp_path / str(k), k)


def test_erasing_leaves_nothing_of_a_first_trial_that_was_cut_short(tmp_path):
    def killed(k):
        folder = study_folder(tmp_path / str(k))
        GUILLOTINE.run(folder.root, k, lambda: session(folder, "P001"))
        return folder

    commit = bisect.bisect(range(200), 0, lo=1, key=lambda k: len(trials(killed(k)))) - 1
    for k in (commit, commit - 1, commit - 4):
        shutil.rmtree(tmp_path / str(k), ignore_errors=True)
        folder = killed(k)
        assert not trials(folder)
        assert [path for path in (folder.root / "data").rglob("*") if path.suffix == ".parquet"]
        assert "episodes: none" in erased(folder, "P001")
        assert not texts(folder.root / "data")
        assert not [path for path, content in texts(folder.root).items() if b"P001" in content]


@pytest.mark.slow
def test_an_erasure_that_is_killed_anywhere_is_finished_by_the_next(two, tmp_path):
    k = 1
    while not erased_in_two_goes(two, tmp_path / str(k), k):
        shutil.rmtree(tmp_path / str(k))
        k += 1
    assert k > 50


def test_every_table_explains_its_columns_and_says_that_nobody_took_part(two):
    readme = (two.exports / "README.txt").read_text()
    assert DEMO in readme
    for name, columns in COLUMNS.items():
        rows = table(two, name)
        assert rows
        assert all(list(row) == list(columns) and row["source"] == DEMO for row in rows)
        assert json.loads((two.exports / f"{name}.json").read_text())["demo"] is True
        assert f"\n{name}\n" in readme
        assert all(f"  {column} " in readme for column in columns)
    for name in ("P001", "P002"):
        for file in ("session.json", "answers.json"):
            assert json.loads((two.root / "participants" / name / file).read_text())["source"] == DEMO
    assert json.loads((two.root / "study.json").read_text())["demo"] is True


def test_no_table_holds_a_formula_and_trials_lead_to_their_episodes(two):
    remarks = [row["value"] for row in table(two, "answers") if row["item"] == "remarks"]
    assert remarks
    assert all(value.startswith("'=said") for value in remarks)
    for row in table(two, "trials"):
        episode = two.episodes(row["condition"], row["task"])[int(row["episode_index"])]
        assert (episode["participant"], episode["trial"]) == (row["participant"], int(row["trial"]))
        assert two.root / row["dataset"] == two.dataset(row["condition"], row["task"])


def test_tables_without_anybody_have_their_headings(tmp_path):
    folder = study_folder(tmp_path)
    session(folder, "P001")
    erased(folder, "P001")
    for name, columns in COLUMNS.items():
        assert (folder.exports / f"{name}.csv").read_text() == ",".join(columns) + "\n"


def test_an_erasure_that_cannot_remove_the_old_files_is_not_done(tmp_path, monkeypatch):
    folder = study_folder(tmp_path)
    for name in ("P001", "P002"):
        session(folder, name)
    keep_files(monkeypatch)
    for _ in range(2):
        with pytest.raises(HandrailError, match=r"\.replaced' could not be removed"):
            erased(folder, "P001")
        assert "P001" in folder.participants()
    monkeypatch.undo()
    assert "erased P001" in erased(folder, "P001")
    assert not list(tmp_path.rglob(".*.replaced"))


def test_nobody_is_erased_whose_episodes_cannot_be(two, tmp_path):
    """A file of the dataset is gone: it would be passed over, and the episodes would stay."""
    shutil.copytree(two.root, tmp_path / "study")
    folder = type(two)(tmp_path / "study")
    (folder.root / "data" / "reach" / "ee" / "meta" / "handrail.json").unlink()
    with pytest.raises(HandrailError, match="expected one that Handrail wrote"):
        erased(folder, "P001")
    assert "P001" in folder.participants()
