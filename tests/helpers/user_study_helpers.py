"""User studies without page and robot: a desk that answers by itself, a track of tiny episodes."""

import csv
import json
import zlib

import numpy as np

from handrail.collect.cockpit.messages import CardAnswer
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.session.outcome import Outcome
from handrail.collect.user_study.conduct import NEXT, PAUSE, Conductor
from handrail.collect.user_study.driving import Briefing
from handrail.collect.user_study.exports import export
from handrail.collect.user_study.folder import StudyFolder
from handrail.collect.user_study.run import erase
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import Feature
from handrail.datasets.recording.writer import EpisodeWriter

SMALL = {
    "title": "A study",
    "consent": "Nobody takes part.",
    "demo": True,
    "modes": ["ee", "direct"],
    "tasks": ["reach"],
    "trials": 1,
    "forms": ["questions"],
    "practice.most": 1,
    "practice.successes": 1,
}
QUESTIONS = """
[[questions]]
name = "trust"
text = "I trusted the robot."
kind = "likert"
[[questions]]
name = "remarks"
text = "What else?"
kind = "text"
"""
_MANIFEST = Manifest(
    "handrail/user_study", 20, "r", {"action": Feature("float32", (2,), ("a", "b"))}, {"handrail": "0"}
)


def study_folder(root, questions=QUESTIONS, **changes):
    """Write a study's file and return the folder."""
    content = SMALL | changes
    lines = [f"{name} = {json.dumps(value)}" for name, value in content.items()]
    root.mkdir(parents=True, exist_ok=True)
    (root / "study.toml").write_text("\n".join(lines) + "\n" + questions)
    return StudyFolder(root)


def answer_of(who, card, item):
    """Return what a synthetic participant answers: always the same."""
    number = zlib.crc32(f"{who} {card} {item['name']}".encode())
    if item["name"] == "consent":
        return "yes"
    if item["kind"] in ("choice", "pair"):
        return item["choices"][number % len(item["choices"])][0]
    if item["kind"] == "text":
        return f"=said {number}"
    places = int((item["most"] - item["least"]) / item["step"]) + 1
    return int(item["least"] + item["step"] * (number % places))


class SyntheticDesk:
    """Answers one item at a time, and only once the one before is acknowledged.

    Args:
        who: answers.
        pauses: at the card of this id.
        own: answers instead of `answer_of`, by item.
    """

    def __init__(self, who, pauses="", **own):
        self._who, self._pauses, self._own = who, pauses, own
        self.cards, self.kept = [], {}

    def show(self, card):
        if not self.cards or self.cards[-1]["id"] != card["id"] or not card["id"]:
            self.cards.append(dict(card))
        self.card = card
        self.kept.setdefault(card["id"], {}).update(card.get("answers", {}))

    def hear(self):
        card = self.card
        if card["id"] == self._pauses:
            return [CardAnswer(card["id"], PAUSE, True)]
        for item in card["items"]:
            if item["name"] not in card["answers"]:
                value = self._own.get(item["name"], answer_of(self._who, card["id"], item))
                return [CardAnswer(card["id"], item["name"], value)]
        return [CardAnswer(card["id"], NEXT, True)]

    @property
    def titles(self):
        return [card.get("title") or card["strip"] for card in self.cards]


class TinyTrack:
    """Records episodes of a few frames.

    Args:
        folder: of the study.
        who: takes part.
        events: what the operator says to end the first trials, before they do them.
    """

    def __init__(self, folder, who, events=()):
        self._folder, self._who, self._events = folder, who, list(events)
        self.done = []

    def prepare(self, mode, task):
        self._place = mode, task
        return Briefing("Do it.", "a mode", ("ee.vx",))

    def run(self, step, seed):
        self.done.append((step.key, seed))
        if step.kind == "trial" and self._events:
            return _outcome(seed, ended_by=self._events.pop(0))
        if step.kind == "practice":
            return _outcome(seed, practice=True)
        root = self._folder.dataset(*self._place)
        there = (root / "meta" / "handrail.json").exists()
        with (EpisodeWriter.resume if there else EpisodeWriter.create)(root, _MANIFEST) as writer:
            for index in range(3):
                writer.add_frame({"action": np.array([index, seed % 97], np.float32)}, "Do it.")
            said = {"participant": self._who, "trial": step.trial, "seed": seed, "failure_reason": ""}
            said |= {"contact_onsets": 0, "brakes": 0, "late": 0, "undos": 0}
            writer.save_episode(said | {"success": True, "wall_time": 1.5})
        return _outcome(seed)


def session(folder, name, desk=None, events=()):
    """Run a session as the command does; return its ending, the desk and the track."""
    with folder.lock():
        folder.freeze()
        folder.settle()
        who = folder.welcome(name)
        desk, track = desk or SyntheticDesk(name), TinyTrack(folder, name, events)
        ending = Conductor(folder, who, desk, track, lambda words: None).run()
        export(folder)
    return ending, desk, track


def erased(folder, name):
    """Erase a participant as the command does."""
    with folder.lock():
        folder.settle()
        return erase(folder, name)


def trials(folder):
    """Return the trials that the datasets hold."""
    return sorted(
        (row["participant"], mode, task, row["trial"])
        for mode, task, _ in folder.conditions
        for row in folder.episodes(mode, task)
    )


def wanted(folder, *names):
    """Return the trials that participants have to do."""
    return sorted(
        (name, mode, task, trial + 1)
        for name in names
        for mode, task, _ in folder.conditions
        for trial in range(folder.study.trials)
    )


def table(folder, name):
    """Return the rows of an exported table."""
    with open(folder.exports / f"{name}.csv", newline="") as file:
        return list(csv.DictReader(file))


def _outcome(seed, ended_by=None, practice=False):
    return Outcome(
        seed, True, "", 3, 0.15, 0.2, 0, 0, 0, 0, 1.0, {}, 0.0, EpisodeEvent(ended_by) if ended_by else None,
        practice=practice,
    )  # fmt: skip
