"""Leads a participant through what is left of their session."""

from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import Any, Protocol

from handrail.collect.cockpit.messages import CardAnswer
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.session.outcome import Outcome
from handrail.collect.user_study import cards
from handrail.collect.user_study.design import UserStudy
from handrail.collect.user_study.folder import StudyFolder
from handrail.collect.user_study.forms import CONSENT, REFUSED, form
from handrail.collect.user_study.items import Form
from handrail.collect.user_study.participant import Participant
from handrail.collect.user_study.plan import (
    Step,
    pairs_rng,
    plan,
    practice_is_over,
    practice_seed,
    trial_seed,
)
from handrail.controllers.errors import HandrailError


class Desk(Protocol):
    """Shows cards and hears answers."""

    def show(self, card: Mapping[str, Any]) -> None:
        """Show a card instead of the one before."""
        ...

    def hear(self) -> list[CardAnswer]:
        """Return what was answered, waiting a little for it."""
        ...


class Track(Protocol):
    """Runs practice and trials."""

    task: str

    @property
    def help(self) -> str:
        """What the mode is, in one line."""
        ...

    @property
    def channels(self) -> tuple[str, ...]:
        """The names of the channels that the operator owns."""
        ...

    def prepare(self, mode: str, task: str) -> None:
        """Make a task in a mode ready."""
        ...

    def run(self, step: Step, seed: int) -> Outcome:
        """Run a trial, or one of practice."""
        ...


class Ending(StrEnum):
    """How a session ended."""

    DONE = "done"
    PAUSED = "paused"
    REFUSED = "refused"


class Conductor:
    """Leads a participant.

    Args:
        folder: of the study.
        study: it.
        who: takes part.
        desk: for forms.
        track: for driving.
        say: is told where they stand.
    """

    def __init__(
        self,
        folder: StudyFolder,
        study: UserStudy,
        who: Participant,
        desk: Desk,
        track: Track,
        say: Callable[[str], None],
    ) -> None:
        self._folder, self._study, self._who = folder, study, who
        self._desk, self._track, self._say = desk, track, say
        self._ready, self._pauses = ("", ""), 0

    def run(self) -> Ending:
        """Do what is left; return how it ended."""
        who, study = self._who, self._study
        steps, left = plan(study, who.slot), self._folder.left(study, who)
        who.note(f"begun with {len(steps) - len(left)} of {len(steps)} steps done")
        for step in left:
            if self._refused:
                break
            self._say(f"{who.name}, step {steps.index(step) + 1} of {len(steps)}: {step}")
            if not self._does(step):
                return self._paused()
        if self._refused:
            self._desk.show(cards.last_card(study, study.title, "Thank you. Nothing is kept of you."))
            return Ending.REFUSED
        who.note("done")
        self._desk.show(cards.last_card(study, "Done", study.thanks))
        return Ending.DONE

    @property
    def _refused(self) -> bool:
        """Whether the participant does not consent, be it before a crash."""
        return CONSENT in self._who.finished() and self._who.answers(CONSENT)[CONSENT] == REFUSED

    def _does(self, step: Step) -> bool:
        """Return whether a step was done; else the participant paused."""
        if step.kind == "form":
            rng = pairs_rng(self._study, self._who.slot, step.condition)
            return self._fills_in(step.key, form(self._study, step.form, rng))
        if self._ready != (step.condition, step.task) and not self._is_introduced(step):
            return False
        return self._practises(step) if step.kind == "practice" else self._tries(step)

    def _fills_in(self, key: str, form: Form) -> bool:
        """Return whether a form was filled in; every answer is on the disk before the page hears of it."""
        who, error = self._who, ""
        while True:
            self._desk.show(cards.form_card(self._study, key, form, who.answers(key), error))
            for said in self._desk.hear():
                if said.card != key:
                    continue  # of a card before, once more
                if said.item == cards.PAUSE:
                    return False
                if said.item == cards.NEXT:
                    if not form.missing(who.answers(key)):
                        who.finish(key)
                        return True
                    continue
                try:
                    value, error = form.item(said.item).check(said.value), ""
                except HandrailError as wrong:
                    error = str(wrong)
                    continue
                if (said.item, value) not in who.answers(key).items():
                    who.answer(key, said.item, value)

    def _is_introduced(self, step: Step) -> bool:
        """Return whether a participant has read what comes and goes on; the robot is made ready before."""
        self._desk.show(cards.last_card(self._study, "One moment", "The robot is made ready."))
        self._track.prepare(step.condition, step.task)
        place = self._who.modes.index(step.condition) + 1
        card = cards.instructions_card(
            self._study,
            step,
            self._track.task,
            self._track.help,
            self._track.channels,
            f"Part {place} of {len(self._study.modes)}",
        )
        while True:
            self._desk.show(card)
            said = [each.item for each in self._desk.hear() if each.card == card["id"]]
            if cards.PAUSE in said:
                return False
            if cards.NEXT in said:
                self._ready = step.condition, step.task
                return True

    def _practises(self, step: Step) -> bool:
        study, who = self._study, self._who
        while True:
            successes = who.practised_so_far(step.condition, step.task)
            if practice_is_over(study.practice, successes):
                return True
            self._desk.show(cards.strip(study, cards.practice_words(study.practice, successes)))
            seed = practice_seed(study, step.condition, step.task, len(successes))
            outcome = self._track.run(step, seed)
            if outcome.ended_by is None or outcome.ended_by.judges:
                who.practised(step, outcome)
            elif outcome.ended_by is EpisodeEvent.QUIT and not self._goes_on():
                return False

    def _tries(self, step: Step) -> bool:
        words = f"Trial {step.trial} of {self._study.trials}: this one counts"
        while True:
            self._desk.show(cards.strip(self._study, words))
            outcome = self._track.run(step, trial_seed(self._study, step.task, step.trial))
            if outcome.kept:
                return True
            self._who.interrupt(step, str(outcome.ended_by))
            if outcome.ended_by is EpisodeEvent.QUIT and not self._goes_on():
                return False

    def _goes_on(self) -> bool:
        """Return whether a participant who paused goes on now."""
        self._pauses += 1
        card = cards.pause_card(self._study, self._pauses)
        self._who.note("paused")
        chosen = ""
        while True:
            self._desk.show(card | {"answers": {"pause": chosen} if chosen else {}})
            for said in self._desk.hear():
                if said.card != card["id"]:
                    continue
                if said.item == "pause" and said.value in (cards.GO_ON, cards.END):
                    chosen = str(said.value)
                elif said.item == cards.NEXT and chosen:
                    return chosen == cards.GO_ON

    def _paused(self) -> Ending:
        self._who.note("ended for today")
        self._desk.show(cards.last_card(self._study, "Paused", "Everything is kept. Go on another time."))
        return Ending.PAUSED
