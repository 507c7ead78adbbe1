"""Laws of a session: everything once, in order; paused or killed, what is missing is done and no more."""

import random
import shutil

import pytest
from command_helpers import refused
from datasets_guillotine import Guillotine
from datasets_helpers import TINY_FEATURES, create, record_one
from user_study_helpers import (
    SyntheticDesk,
    TinyTrack,
    answer_of,
    erased,
    session,
    study_folder,
    table,
    trials,
    wanted,
)

from handrail.collect.cockpit.messages import CardAnswer
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.user_study.conduct import Ending
from handrail.collect.user_study.config import StudySessionConfig
from handrail.collect.user_study.design import Practice
from handrail.collect.user_study.folder import StudyFolder
from handrail.collect.user_study.plan import practice_seed, trial_seed
from handrail.collect.user_study.run import status, study_session
from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.scores import DEMO

GUILLOTINE = Guillotine()


def test_a_session_does_everything_once_in_the_participant_s_order(tmp_path):
    folder = study_folder(
        tmp_path, tasks=["reach", "pick_place"], trials=2, forms=["tlx", "sus", "questions"]
    )
    ending, desk, track = session(folder, "P001")
    who, study = folder.participant("P001"), folder.study
    assert ending is Ending.DONE
    assert not folder.left(who)
    assert trials(folder) == wanted(folder, "P001")
    steps = folder.steps(who)
    assert track.done == [
        (
            step.key,
            trial_seed(study, step.task, step.trial)  # the same scenes for everybody, in every mode
            if step.trial
            else practice_seed(study, step.condition, step.task, 0),
        )
        for step in steps
        if step.kind != "form"
    ]
    assert list(who.forms) == [step.key for step in steps if step.kind == "form"]
    assert desk.titles[0] == study.title
    assert all(card["note"] == DEMO for card in desk.cards)
    again, _, track = session(folder, "P001")
    assert again is Ending.DONE
    assert not track.done


def test_a_participant_s_order_is_drawn_once(tmp_path):
    folder = study_folder(tmp_path, modes=["ee", "direct", "joints"])
    session(folder, "P001", SyntheticDesk("P001", pauses="P001/consent"))
    who = folder.participant("P001")
    who.keep(modes=who.session.modes[::-1])  # as another version of NumPy may have drawn them
    _, desk, track = session(folder, "P001")
    driven = [key.split("/")[0] for key, _ in track.done if key.endswith("/1")]
    assert driven == list(who.session.modes)
    position = {row["condition"]: int(row["position"]) for row in table(folder, "trials")}
    assert position == {mode: index + 1 for index, mode in enumerate(driven)}
    parts = [card["text"][0].split()[-1] for card in desk.cards if card.get("title", "").startswith("Part ")]
    assert parts == driven
    assert status(folder).rows[0][1:3] == (", ".join(driven), "10 of 10")


def test_newcomers_get_free_rows_of_the_design(tmp_path):
    folder = study_folder(tmp_path)
    for name in ("P001", "P002", "P003"):
        session(folder, name)
    assert [each.session.slot for each in folder.participants().values()] == [0, 1, 2]
    erased(folder, "P002")
    session(folder, "P009")
    assert {name: each.session.slot for name, each in folder.participants().items()} == {
        "P001": 0,
        "P003": 2,
        "P009": 1,
    }


@pytest.mark.parametrize(
    "name", ["anna", "P1", "p001", "../P001", "P001/x", "Anna Smith", "", "P0000001", "P001\n"]
)
def test_an_id_that_may_be_a_name_is_refused(name, tmp_path):
    folder = study_folder(tmp_path)
    with pytest.raises(HandrailError, match="expected an id that says nothing of the person"):
        session(folder, name)
    assert not (tmp_path / "participants").exists()


@pytest.mark.parametrize("verb", ["status", "run", "erase", "export"])
def test_a_folder_that_is_not_there_is_not_made(verb, tmp_path):
    typo = tmp_path / "my study"
    advice = f"write one: handrail-user-study new '{typo}'"
    refused(verb, typo, *["P001"] * (verb in ("run", "erase")), name="user-study", told=advice)
    assert not typo.exists()


def test_practice_lasts_until_enough_successes_in_a_row_and_is_not_recorded(tmp_path):
    folder = study_folder(tmp_path, **{"practice.successes": 2, "practice.most": 5})
    _, desk, track = session(folder, "P001")
    assert sum(key.endswith("practice") for key, _ in track.done) == 4  # two in each mode
    assert trials(folder) == wanted(folder, "P001")
    assert [row["number"] for row in table(folder, "practice")] == ["1", "2", "1", "2"]
    strips = [title for title in desk.titles if title.startswith("Practice")]
    assert strips[1].endswith("1 of 2 successes in a row")


@pytest.mark.parametrize(
    ("successes", "over"),
    [
        ([True], False),
        ([True, False, True], False),
        ([False, True, True], True),
        ([False] * 4, False),
        ([False] * 5, True),
    ],
)
def test_practice_is_over_after_successes_in_a_row_or_enough_attempts(successes, over):
    assert Practice(successes=2, most=5).is_over(successes) is over


def test_without_consent_nobody_drives_and_it_is_said(tmp_path):
    folder = study_folder(tmp_path)
    ending, desk, track = session(folder, "P001", SyntheticDesk("P001", consent="no"))
    assert ending is Ending.REFUSED
    assert not track.done
    assert desk.titles == ["A study", "A study"]
    again, _, track = session(folder, "P001")  # killed before what there is of them was removed
    assert again is Ending.REFUSED
    assert not track.done


def test_a_trial_that_is_paused_begins_anew_and_is_counted(tmp_path):
    folder = study_folder(tmp_path)
    ending, desk, track = session(folder, "P001", SyntheticDesk("P001", pause="on"), [EpisodeEvent.QUIT])
    assert ending is Ending.DONE
    assert "Paused" in desk.titles
    first = [each for each in track.done if each[0].endswith("/1")]
    assert first[0] == first[1]
    assert sum(int(row["interrupted"]) for row in table(folder, "trials")) == 1
    assert trials(folder) == wanted(folder, "P001")


def test_a_trial_that_is_cut_is_counted(tmp_path, monkeypatch):
    folder, run, cuts = study_folder(tmp_path), TinyTrack.run, [1, 1, 1]

    def cut(track, step, seed):
        if step.kind == "trial" and cuts:
            cuts.pop()
            raise KeyboardInterrupt
        return run(track, step, seed)

    monkeypatch.setattr(TinyTrack, "run", cut)
    while cuts:
        with pytest.raises(KeyboardInterrupt):
            session(folder, "P001")
    session(folder, "P001", events=[EpisodeEvent.RESTART])  # and once more, by the participant
    assert sorted(row["interrupted"] for row in table(folder, "trials")) == ["0", "4"]


def test_a_participant_who_ends_for_today_goes_on_with_that_trial(tmp_path):
    folder = study_folder(tmp_path)
    desk = SyntheticDesk("P001", pause="end")
    ending, _, before = session(folder, "P001", desk, [EpisodeEvent.QUIT])
    assert ending is Ending.PAUSED
    assert not trials(folder)
    ending, _, after = session(folder, "P001")
    assert ending is Ending.DONE
    assert after.done[0] == before.done[-1]
    assert trials(folder) == wanted(folder, "P001")


def test_a_form_that_is_paused_keeps_what_was_answered(tmp_path):
    folder = study_folder(tmp_path)
    half = SyntheticDesk("P001")
    half.hear = lambda: [CardAnswer(half.card["id"], *half_answered(half))]
    ending, _, _ = session(folder, "P001", half)
    assert ending is Ending.PAUSED
    key = next(card["id"] for card in half.cards if card["id"].endswith("/questions"))
    assert list(folder.participant("P001").answers(key.removeprefix("P001/"))) == ["trust"]
    _, desk, _ = session(folder, "P001")
    assert desk.cards[0]["answers"]["trust"] == half.kept[key]["trust"]


def test_no_card_of_one_participant_takes_an_answer_of_another(tmp_path):
    folder = study_folder(tmp_path)
    asked = [session(folder, name)[1].cards for name in ("P001", "P002")]
    one, other = ({card["id"] for card in cards if card.get("items")} for cards in asked)
    assert len(one) == len(other) == 3
    assert (
        not one & other
    )  # a page whose server was lost sends again what was not kept, to whoever comes next


def test_nobody_begins_in_a_study_that_is_not_frozen(tmp_path, monkeypatch):
    folder = study_folder(tmp_path)

    def full(*_):
        raise HandrailError("the disk is full")

    monkeypatch.setattr(StudyFolder, "freeze", full)
    with pytest.raises(HandrailError, match="the disk is full"):
        study_session(StudySessionConfig("run", str(tmp_path), "P001"))
    assert not folder.participants()
    with pytest.raises(HandrailError, match="expected an id"):
        study_session(StudySessionConfig("run", str(tmp_path), "Anna"))


def half_answered(desk):
    """Answer the first question of a form of one's own, then pause."""
    card = desk.card
    left = [item for item in card["items"] if item["name"] not in card["answers"]]
    if card["id"].endswith("/questions") and len(left) == 1:
        return ":pause", True
    return (left[0]["name"], answer_of("P001", card["id"], left[0])) if left else (":next", True)


def test_wrong_late_and_early_answers_change_nothing(tmp_path):
    folder = study_folder(tmp_path)
    desk = SyntheticDesk("P001")
    odd = [
        CardAnswer("another/card", "trust", 3),
        CardAnswer("P001/consent", ":next", True),
        CardAnswer("P001/consent", "consent", None),
        CardAnswer("P001/consent", "consent", "perhaps"),
        CardAnswer("P001/consent", "nothing", 1),
    ]
    errors = []
    honest = desk.hear

    def hear():
        errors.append(desk.card.get("error"))
        return [odd.pop(0)] if odd else honest()

    desk.hear = hear
    session(folder, "P001", desk)
    assert any("expected one of yes, no" in error for error in errors if error)
    assert folder.participant("P001").answers("consent") == {"consent": "yes"}


def killed_and_resumed(root, k):
    """Kill a session at its k-th change to the disk; return whether it lived. Then go on and check."""
    folder = study_folder(root)
    desk = SyntheticDesk("P001")
    lived = GUILLOTINE.run(root, k, lambda: session(folder, "P001", desk))
    if (root / "participants" / "P001" / "session.json").exists():
        who = folder.participant("P001")
        for key, kept in desk.kept.items():
            assert kept.items() <= who.answers(key.removeprefix("P001/")).items(), (
                f"an answer was lost at change {k}"
            )
    before = trials(folder) if (root / "study.json").exists() else []
    _, _, track = session(folder, "P001")
    assert trials(folder) == wanted(folder, "P001")
    redone = [key for key, _ in track.done if not key.endswith("practice")]
    assert len(redone) == len(wanted(folder, "P001")) - len(before)
    assert len(table(folder, "trials")) == 2
    for card in desk.cards:
        for item in card.get("items", ()):
            kept = folder.participant("P001").answers(card["id"].removeprefix("P001/"))
            assert kept[item["name"]] == answer_of("P001", card["id"], item)
    return lived


def test_killed_at_some_changes_to_the_disk_nothing_is_lost_or_done_twice(tmp_path):
    for k in random.Random(0).sample(range(1, 160), 5):
        killed_and_resumed(tmp_path / str(k), k)


@pytest.mark.slow
def test_killed_at_every_change_to_the_disk_nothing_is_lost_or_done_twice(tmp_path):
    k = 1
    while not killed_and_resumed(tmp_path / str(k), k):
        shutil.rmtree(tmp_path / str(k))
        k += 1
    assert k > 100


def test_a_dataset_of_something_else_is_no_trial(tmp_path):
    folder = study_folder(tmp_path)
    session(folder, "P001")
    place = folder.dataset("ee", "reach")
    shutil.rmtree(place)
    with create(place, features=TINY_FEATURES) as writer:
        record_one(writer, cameras=False)
    with pytest.raises(HandrailError, match="expected trials of a user study, got other episodes"):
        session(folder, "P001")
