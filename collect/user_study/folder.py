"""The folder of a user study.

```
study.toml                   as it was written
study.json                   as it was when the first participant began: frozen, with the versions
participants/P001/           session.json, answers.json
data/TASK/MODE               a LeRobot dataset of all participants
exports/                     tables for whoever reads them: CSV, JSON, README.txt
```
"""

import os
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from handrail.collect.user_study.design import UserStudy
from handrail.collect.user_study.participant import Participant, SessionRecord, check_id, now
from handrail.collect.user_study.plan import Step, orders, plan
from handrail.controllers.errors import HandrailError, check_known
from handrail.controllers.strict_toml import read_toml
from handrail.controllers.typed import Text, decoded
from handrail.controllers.versions import SIMULATION, versions
from handrail.datasets.reading.reader import read_episodes
from handrail.datasets.recording.rewrite import settle
from handrail.datasets.storage.atomic import explained, remove, sync, write_whole
from handrail.datasets.storage.lock import FolderLock
from handrail.datasets.storage.strict_json import load_json, write_json

_EXAMPLE = Path(__file__).parent / "example.toml"


@dataclass(frozen=True)
class FrozenStudy:
    """Content of `study.json`."""

    study: Mapping[str, Any]
    demo: bool
    versions: Mapping[str, Text]
    frozen: Text  # the time


class StudyFolder:
    """A study's folder, whose study is read once."""

    def __init__(self, root: Path) -> None:
        self.root, self.exports = root, root / "exports"
        self._written, self._frozen = root / "study.toml", root / "study.json"
        self._participants = root / "participants"
        self._forgotten = self._participants / ".erased"

    def write_example(self) -> Path:
        """Write a study's file to begin with, and return its path."""
        if self._written.exists() or self._frozen.exists():
            raise HandrailError(f"{str(self.root)!r}: expected a new folder, found a study; it is left alone")
        with explained(f"cannot write {str(self._written)!r}"):
            write_whole(self._written, _EXAMPLE.read_bytes())
        return self._written

    @cached_property
    def study(self) -> UserStudy:
        """The study: as it is frozen, or else as it is written."""
        if not self._frozen.exists():
            return decoded(self._content(), UserStudy, f"study {self._written}")
        frozen = self.frozen
        if self._written.exists() and self._content() != frozen.study:
            raise HandrailError(
                f"study {self._written}: it was changed after {frozen.frozen}, when the first participant"
                f" began: expected the text of {self._frozen.name}; put it back, or begin a new folder"
            )
        return decoded(frozen.study, UserStudy, f"study {self._frozen}")

    @cached_property
    def frozen(self) -> FrozenStudy:
        """The study as it is frozen."""
        content = load_json(self._frozen, "a study of handrail-user-study")
        return decoded(content, FrozenStudy, str(self._frozen))

    def freeze(self) -> None:
        """Let the study stay as it is from now on."""
        study = self.study
        if self._frozen.exists():
            return
        content = {"study": self._content(), "demo": study.demo, "versions": versions(*SIMULATION)}
        with explained(f"cannot write {str(self._frozen)!r}"):
            write_json(self._frozen, content | {"frozen": now()})

    def lock(self) -> FolderLock:
        """Return the right to change the study."""
        with explained(f"cannot write {str(self.root)!r}"):
            return FolderLock(self.root / ".handrail", f"study {str(self.root)!r}", "handrail-user-study")

    def participants(self) -> dict[str, Participant]:
        """Return everybody who has begun, by id."""
        files = sorted(self._participants.glob("[A-Z]*/session.json"))
        return {path.parent.name: Participant(path.parent) for path in files}

    def participant(self, name: str) -> Participant:
        """Return somebody who has begun."""
        check_id(name)
        known = self.participants()
        check_known("participant", (name,), known or ("nobody yet",))
        return known[name]

    def welcome(self, name: str) -> Participant:
        """Return a participant, of a study that is frozen; a newcomer gets the first free row of the design.

        That of somebody who was erased is free again, so that the rows stay balanced.
        """
        check_id(name)
        self.freeze()  # before anybody has an order
        there = self.participants()
        if name in there:
            if there[name].session.erasing:
                raise HandrailError(f"participant {name} is being erased: finish that with erase first")
            return there[name]
        taken = {each.session.slot for each in there.values()}
        slot = next(slot for slot in range(len(taken) + 1) if slot not in taken)
        modes, tasks = orders(self.study, slot)
        session = SessionRecord(name, self.study.source, slot, modes, tasks, (), (), (), erasing=False)
        return Participant(self._participants / name, session)

    def dataset(self, mode: str, task: str) -> Path:
        """Return the folder of a dataset."""
        return self.root / "data" / task / mode

    @property
    def conditions(self) -> list[tuple[str, str, Path]]:
        """All modes and tasks, and the folders of their datasets."""
        study = self.study
        return [(mode, task, self.dataset(mode, task)) for mode in study.modes for task in study.tasks]

    def episodes(self, mode: str, task: str) -> list[dict[str, Any]]:
        """Return the metadata of all trials of a task in a mode."""
        root = self.dataset(mode, task)
        rows = read_episodes(root) if (root / "meta" / "episodes").is_dir() else []  # else none was saved
        if any(not {"participant", "trial"} <= set(row) for row in rows):
            raise HandrailError(f"dataset {str(root)!r}: expected trials of a user study, got other episodes")
        return rows

    def forget(self, name: str) -> None:
        """Remove the files of a participant, all at once."""
        place = self._participants / name
        with explained(f"cannot remove {str(place)!r}"):
            os.replace(place, self._forgotten)
            sync(self._participants)
            remove(self._forgotten)

    def settle(self) -> None:
        """Finish an erasure that was cut short; the caller holds the lock."""
        with explained(f"cannot write {str(self.root)!r}"):
            remove(self._forgotten)
            for _, _, root in self.conditions:
                settle(root)

    def steps(self, who: Participant) -> tuple[Step, ...]:
        """Return all steps, in the order that was drawn when the participant was new."""
        return tuple(plan(self.study, who.session.modes, who.session.tasks))

    def left(self, who: Participant) -> list[Step]:
        """Return the steps that are left; practice is over once a trial after it is done."""
        done = set(who.finished)
        for mode, task, _ in self.conditions:
            trials = {
                f"{mode}/{task}/{row['trial']}"
                for row in self.episodes(mode, task)
                if row["participant"] == who.name
            }
            if trials or self.study.practice.is_over(who.practised(mode, task)):
                done.add(Step("practice", mode, task).key)
            done |= trials
        return [step for step in self.steps(who) if step.key not in done]

    def _content(self) -> dict[str, Any]:
        if not self._written.exists():
            raise HandrailError(
                f"{str(self.root)!r}: expected a folder with study.toml, found none;"
                f" write one: handrail-user-study new {shlex.quote(str(self.root))}"
            )
        return read_toml(self._written, "study")
