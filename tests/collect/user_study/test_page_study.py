"""A study through the real page: synthetic participants steer by keys and answer forms; one is killed."""

import json
from contextlib import contextmanager

import pytest
from command_helpers import command
from page_recording import started
from participant_driver import REMARK, ParticipantDriver
from playwright.sync_api import expect
from user_study_helpers import study_folder

from handrail.collect.user_study.questionnaires import PAIRS, sus_score, tlx_raw, tlx_weighted
from handrail.datasets.comparison.scores import DEMO

pytestmark = pytest.mark.slow
MODES, TASKS = ("ee", "base+ee", "direct"), ("reach", "pick_place")
QUESTIONS = """
[[questions]]
name = "age"
text = "How old are you?"
kind = "number"
least = 18
most = 120
when = "start"
[[questions]]
name = "remarks"
text = "What else?"
kind = "text"
when = "end"
"""


@contextmanager
def running(root, name):
    """Run a participant's session; give its process and address."""
    with started("user-study", "run", root, name) as (process, address, said):
        assert DEMO in said
        yield process, address


def half_a_form(driver):
    """Go on until NASA-TLX, and answer half of its scales."""
    driver.go_on(lambda each: each.title.startswith("How was it?"))
    driver.fill_in(most=3)
    expect(driver.page.locator("#study-state")).to_have_text("3 to answer", timeout=60_000)


def killed_and_resumed(page, root):
    with running(root, "P001") as (process, address):
        before = ParticipantDriver(page, address, 1)
        half_a_form(before)
        process.kill()
    with running(root, "P001") as (process, address):
        driver = ParticipantDriver(page, address, 2, answers=before.answers)
        assert driver.go_on() == "Done"
        assert process.wait(60) == 0
    return driver.answers, before.trials + driver.trials


def reloaded(page, root):
    with running(root, "P002") as (process, address):
        before = ParticipantDriver(page, address, 3)
        half_a_form(before)
        driver = ParticipantDriver(page, address, 4, ("frustration", "q7"), before.answers)
        assert driver.go_on() == "Done"
        assert process.wait(60) == 0
    return driver.answers, before.trials + driver.trials


def computed(answers, mode):
    """Return the scores of a participant's answers."""
    scales, pairs = answers[f"{mode}/tlx"], answers[f"{mode}/tlx_pairs"]
    assert set(pairs) == {"_".join(pair) for pair in PAIRS}
    sus = sus_score(answers[f"{mode}/sus"])
    return {"tlx_raw": tlx_raw(scales), "tlx_weighted": tlx_weighted(scales, pairs), "sus": sus}


def test_a_study_of_two_through_the_page_killed_and_resumed(new_page, tmp_path):
    page = new_page(viewport={"width": 1280, "height": 720})
    root = tmp_path / "study"
    folder = study_folder(root, QUESTIONS, modes=MODES, tasks=TASKS, forms=["tlx", "sus"])
    said, driven = {}, {}
    said["P001"], driven["P001"] = killed_and_resumed(page, root)
    said["P002"], driven["P002"] = reloaded(page, root)
    assert driven == {"P001": 12, "P002": 12}  # one of practice and one that counts, of 2 tasks in 3 modes

    pandas = pytest.importorskip("pandas")
    tables = {
        name: pandas.read_csv(root / "exports" / f"{name}.csv") for name in ("answers", "scores", "trials")
    }
    assert all(set(table["source"]) == {DEMO} for table in tables.values())
    for row in tables["scores"].itertuples():
        score = computed(said[row.participant], row.condition)[row.score]
        assert pandas.isna(row.value) if score is None else row.value == pytest.approx(score), row
    assert len(tables["scores"]) == 2 * 3 * 3
    assert tables["scores"]["value"].notna().any()
    assert tables["scores"]["value"].isna().any()  # P002 declined two questions

    kept = json_answers(root)
    for name, cards in said.items():
        for card, items in cards.items():
            if items:
                assert kept[name][card] == items
    assert set(tables["answers"].query("item == 'remarks'")["value"]) == {"'" + REMARK}

    trials = tables["trials"]
    assert len(trials) == 2 * 3 * 2
    assert trials.groupby("task")["seed"].nunique().eq(1).all()
    assert trials[(trials.task == "reach") & (trials.condition == "ee")]["success"].all()
    for row in trials.itertuples():
        episode = folder.episodes(row.condition, row.task)[row.episode_index]
        assert (episode["participant"], episode["seed"]) == (row.participant, row.seed)

    done = command("--study", root, "--output", tmp_path / "report", name="compare")
    assert done.returncode == 0, done.stderr
    assert "demo" in done.stdout


def test_next_waits_until_what_is_typed_is_what_is_kept(new_page, tmp_path):
    root = tmp_path / "study"
    study_folder(root, QUESTIONS.replace('"end"', '"start"'), forms=[])
    with running(root, "P001") as (_, address):
        driver = ParticipantDriver(new_page(), address, 5)
        driver.go_on(lambda each: each.title == "Before we begin")
        page, state = driver.page, driver.page.locator("#study-state")
        age, remark = page.locator("#study input[type=number]"), page.locator("#study textarea")
        age.fill("25")
        remark.fill(REMARK)
        saved = "All answered and saved."
        expect(state).to_have_text(saved, timeout=60_000)
        for field, wrong, right in ((age, "250", "26"), (remark, "", "More")):
            field.fill(wrong)
            expect(state).to_have_text("1 to answer")
            field.blur()
            page.wait_for_timeout(2500)  # answers are drawn again each second
            expect(state).to_have_text("1 to answer")
            expect(driver.at("study-next")).to_be_disabled()
            assert field.input_value() == wrong
            field.fill(right)
            expect(state).to_have_text(saved, timeout=60_000)
        page.get_by_label("I prefer not to answer").first.check()
        expect(state).to_have_text(saved, timeout=60_000)
        assert json_answers(root)["P001"]["start"] == {"age": None, "remarks": "More"}


def json_answers(root):
    """Return the answers on the disk by participant and form."""
    files = sorted(root.glob("participants/*/answers.json"))
    content = [json.loads(file.read_text()) for file in files]
    return {
        each["participant"]: {form: said["items"] for form, said in each["forms"].items()} for each in content
    }
