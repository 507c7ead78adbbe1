"""A participant's session: pages to read, forms to fill in, practice and trials."""

from collections.abc import Callable
from dataclasses import asdict
from enum import StrEnum
from functools import partial
from typing import Any

from handrail.collect.cockpit.cards import Cards
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.user_study.driving import Driving
from handrail.collect.user_study.folder import StudyFolder
from handrail.collect.user_study.forms import CONSENT, REFUSED, form
from handrail.collect.user_study.items import Answer, Form, Item
from handrail.collect.user_study.participant import Interrupted, Noted, Participant, Practised
from handrail.collect.user_study.plan import Step, pairs_rng, practice_seed, trial_seed
from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.scores import DEMO

NEXT, PAUSE = ":next", ":pause"  # answers of the buttons; no question is called so
_GO_ON = "on"
_PAUSED = Item(
    "pause",
    "choice",
    "You have paused. The trial that you were in begins anew when you go on.",
    choices=((_GO_ON, "Go on now"), ("end", "End for today; go on another time")),
    declines=False,
)


class Ending(StrEnum):
    """How a session ended."""

    DONE = "done"
    PAUSED = "paused"
    REFUSED = "refused"


class Conductor:
    """Leads a participant through the steps that are left.

    Args:
        folder: of the study.
        who: takes part.
        cards: of the page.
        driving: for practice and trials.
        say: is told where they stand.
    """

    def __init__(
        self,
        folder: StudyFolder,
        who: Participant,
        cards: Cards,
        driving: Driving,
        say: Callable[[str], None],
    ) -> None:
        self._folder, self._study, self._who = folder, folder.study, who
        self._cards, self._driving, self._say = cards, driving, say
        self._ready, self._pauses = ("", ""), 0

    def run(self) -> Ending:
        """Do what is left; return how it ended."""
        who, steps, left = self._who, self._folder.steps(self._who), self._folder.left(self._who)
        self._note(f"begun with {len(steps) - len(left)} of {len(steps)} steps done")
        for step in left:
            if self._is_refused:
                break
            self._say(f"{who.name}, step {steps.index(step) + 1} of {len(steps)}: {step}")
            if not self._does(step):
                self._note("ended for today")
                self._show_last("Paused", "Everything is kept. Go on another time.")
                return Ending.PAUSED
        if self._is_refused:
            self._show_last(self._study.title, "Thank you. Nothing is kept of you.")
            return Ending.REFUSED
        self._note("done")
        self._show_last("Done", self._study.thanks)
        return Ending.DONE

    @property
    def _is_refused(self) -> bool:
        """Whether the participant does not consent, be it before a crash."""
        return CONSENT in self._who.finished and self._who.answers(CONSENT)[CONSENT] == REFUSED

    def _note(self, what: str) -> None:
        self._who.add(events=Noted(what))

    def _does(self, step: Step) -> bool:
        """Return whether a step was done; else the participant paused."""
        if step.kind == "form":
            return self._fills_in(step)
        if self._ready != (step.condition, step.task) and not self._is_introduced(step):
            return False
        return self._practises(step) if step.kind == "practice" else self._tries(step)

    def _fills_in(self, step: Step) -> bool:
        who, key = self._who, step.key
        asked = form(self._study, step.form, pairs_rng(self._study, who.session.slot, step.condition))
        done = self._ask(key, asked, who.answers(key), partial(who.answer, key), pause=step.form != CONSENT)
        if done:
            who.finish(key)
        return done

    def _is_introduced(self, step: Step) -> bool:
        """Return whether a participant has read what comes and goes on; the robot is made ready before."""
        study, mode = self._study, step.condition
        self._show_last("One moment", "The robot is made ready.")
        briefing = self._driving.prepare(mode, step.task)
        help_ = study.instructions.get(mode, f"{briefing.help[:1].upper()}{briefing.help[1:]}.")
        practice = f"Practice first: at most {study.practice.most}. " if study.practice.most else ""
        text = (
            f"Your way of steering now: {mode}\n\n{help_}\n\nThe task: {briefing.task}\n\n{practice}"
            f"Trials that count: {study.trials}. Failed gives a trial up; Pause holds it."
        )
        place = self._who.session.modes.index(mode) + 1
        page = Form("instructions", f"Part {place} of {len(study.modes)}", text)
        done = self._ask(f"{mode}/{step.task}/instructions", page, {}, keys=briefing.channels)
        if done:
            self._ready = mode, step.task
        return done

    def _practises(self, step: Step) -> bool:
        practice, mode, task = self._study.practice, step.condition, step.task
        while not practice.is_over(successes := self._who.practised(mode, task)):
            row = next((n for n, success in enumerate(reversed(successes)) if not success), len(successes))
            self._show_strip(
                f"Practice {len(successes) + 1} of at most {practice.most}, nothing is saved: "
                f"{row} of {practice.successes} successes in a row"
            )
            outcome = self._driving.run(step, practice_seed(self._study, mode, task, len(successes)))
            if outcome.ended_by is None or outcome.ended_by.judges:
                seconds = round(outcome.seconds, 3)
                self._who.add(practice=Practised(mode, task, outcome.seed, outcome.success, seconds))
            elif outcome.ended_by is EpisodeEvent.QUIT and not self._goes_on():
                return False
        return True

    def _tries(self, step: Step) -> bool:
        while True:
            self._show_strip(f"Trial {step.trial} of {self._study.trials}: this one counts")
            self._note(f"{step.key} begun")  # a crash leaves no other trace of it
            outcome = self._driving.run(step, trial_seed(self._study, step.task, step.trial))
            if outcome.kept:
                return True
            ended = Interrupted(step.condition, step.task, step.trial, str(outcome.ended_by))
            self._who.add(interrupted=ended)
            if outcome.ended_by is EpisodeEvent.QUIT and not self._goes_on():
                return False

    def _goes_on(self) -> bool:
        """Return whether a participant who paused goes on now."""
        self._pauses += 1
        self._note("paused")
        asked, answers = Form("pause", "Paused", items=(_PAUSED,)), {}
        done = self._ask(f"pause/{self._pauses}", asked, answers, pause=False)
        return done and answers[_PAUSED.name] == _GO_ON

    def _ask(
        self,
        key: str,
        asked: Form,
        answers: dict[str, Answer],
        keep: Callable[[str, Answer], None] = lambda item, value: None,
        **look: Any,
    ) -> bool:
        """Return whether a form was filled in, not paused; an answer is kept before the page hears of it.

        Args:
            key: of the card, whose id says also who is asked: a page sends again what is not yet kept.
            asked: the form.
            answers: so far; those to come are added.
            keep: puts an answer on the disk.
            look: of the card.
        """
        card, error = self._card(f"{self._who.name}/{key}", asked, **look), ""
        while True:
            self._cards.show({**card, "answers": dict(answers), "error": error})
            for said in self._cards.hear():
                if said.card != card["id"]:
                    continue  # of a card before, once more
                if said.item == PAUSE:
                    return False
                if said.item == NEXT:
                    if all(item.name in answers for item in asked.items):
                        return True
                    continue
                try:
                    value, error = asked.check(said.item, said.value), ""
                except HandrailError as wrong:
                    error = str(wrong)
                    continue
                if (said.item, value) not in answers.items():
                    keep(said.item, value)
                    answers[said.item] = value

    def _card(self, key: str, page: Form, **more: Any) -> dict[str, Any]:
        """Return a page as the cockpit shows it, with `keys`, `pause` and `last` as said or as by default."""
        look = {"answers": {}, "error": "", "keys": (), "pause": True, "last": False, "note": self._demo_note}
        text = [" ".join(part.split()) for part in page.text.split("\n\n") if part.strip()]
        items = [asdict(item) for item in page.items]
        return {"id": key, "title": page.title, "text": text, "items": items, **look, **more}

    def _show_last(self, title: str, text: str) -> None:
        self._cards.show(self._card(f"last/{title}", Form("last", title, text), pause=False, last=True))

    def _show_strip(self, words: str) -> None:
        """Show words above the robot; they cover nothing."""
        self._cards.show({"id": "", "strip": words, "note": self._demo_note})

    @property
    def _demo_note(self) -> str:
        return DEMO if self._study.demo else ""
