"""Where everything of a user study lies.

```
study.toml                   as it was written
study.json                   as it was when the first participant began: frozen, with the versions
participants/P001/           session.json, answers.json
data/TASK/MODE               a LeRobot dataset of all participants
exports/                     tables for whoever reads them: CSV, JSON, README.txt
```
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from handrail.collect.user_study.design import UserStudy
from handrail.collect.user_study.load import parse_study
from handrail.collect.user_study.participant import Participant, check_id, now
from handrail.collect.user_study.plan import Step, orders, plan, practice_is_over, remaining
from handrail.controllers.entries import Entry, check_entries, is_table, is_text
from handrail.controllers.errors import HandrailError, unknown_name
from handrail.controllers.strict_toml import read_toml
from handrail.controllers.versions import SIMULATION, versions
from handrail.datasets.reading.reader import read_episodes
from handrail.datasets.recording.rewrite import settle
from handrail.datasets.storage.atomic import explained, remove, sync_folder, write_whole
from handrail.datasets.storage.lock import DatasetLock
from handrail.datasets.storage.strict_json import load_json, write_json

_FROZEN: Mapping[str, Entry] = {
    "study": Entry("a table", is_table),
    "demo": Entry("true or false", lambda value: isinstance(value, bool)),
    "versions": Entry("a table", is_table),
    "frozen": Entry("a time", is_text),
}
_EXAMPLE = Path(__file__).parent / "example.toml"


class StudyFolder:
    """A study's folder.

    Args:
        root: of it.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self._written, self._frozen = root / "study.toml", root / "study.json"
        self._participants, self._data = root / "participants", root / "data"
        self._forgotten = self._participants / ".erased"

    @property
    def exports(self) -> Path:
        """Where the tables are."""
        return self.root / "exports"

    def write_example(self) -> Path:
        """Write a study's file to begin with, and return its path."""
        if self._written.exists() or self._frozen.exists():
            raise HandrailError(f"{str(self.root)!r}: expected a new folder, found a study; it is left alone")
        with explained(f"cannot write {str(self._written)!r}"):
            write_whole(self._written, _EXAMPLE.read_bytes())
        return self._written

    def study(self) -> UserStudy:
        """Return the study: as it is frozen, or else as it is written."""
        if not self._frozen.exists():
            return parse_study(self._content(), f"study {self._written}")
        content = load_json(self._frozen, "a study of handrail-user-study")
        check_entries(content, _FROZEN, str(self._frozen))
        if self._written.exists() and self._content() != content["study"]:
            raise HandrailError(
                f"study {self._written}: it was changed after {content['frozen']}, when the first participant"
                f" began: expected what {self._frozen.name} says; put it back, or begin a new folder"
            )
        return parse_study(content["study"], f"study {self._frozen}")

    def freeze(self) -> UserStudy:
        """Return the study, which stays as it is from now on."""
        study = self.study()
        if not self._frozen.exists():
            content = {"study": self._content(), "demo": study.demo, "versions": versions(*SIMULATION)}
            with explained(f"cannot write {str(self._frozen)!r}"):
                write_json(self._frozen, content | {"frozen": now()})
        return study

    def lock(self) -> DatasetLock:
        """Return the right to change the study."""
        with explained(f"cannot write {str(self.root)!r}"):
            return DatasetLock(self.root / ".handrail", "study", "handrail-user-study")

    def participants(self) -> list[Participant]:
        """Return everybody who has begun, by id."""
        files = sorted(self._participants.glob("[A-Z]*/session.json"))
        return [Participant(path.parent) for path in files]

    def participant(self, name: str) -> Participant:
        """Return somebody who has begun."""
        check_id(name)
        known = [each.name for each in self.participants()]
        if name not in known:
            raise unknown_name("participant", name, known or ("nobody yet",))
        return Participant(self.place(name))

    def welcome(self, name: str, study: UserStudy) -> Participant:
        """Return a participant; a newcomer gets the first free row of the design.

        That of somebody who was erased is free again, so that the rows stay balanced.
        """
        check_id(name)
        there = {each.name: each for each in self.participants()}
        if name in there and there[name].erasing:
            raise HandrailError(f"participant {name} is being erased: finish that with erase first")
        if name in there:
            return there[name]
        taken = {each.slot for each in there.values()}
        slot = next(slot for slot in range(len(taken) + 1) if slot not in taken)
        with explained(f"cannot write {str(self.place(name))!r}"):
            return Participant.create(self.place(name), study.source, slot, *orders(study, slot))

    def place(self, name: str) -> Path:
        """Return the folder of a participant."""
        return self._participants / name

    def dataset(self, mode: str, task: str) -> Path:
        """Return the folder of a dataset."""
        return self._data / task / mode

    def episodes(self, mode: str, task: str) -> list[dict[str, Any]]:
        """Return the metadata of all trials of a task in a mode."""
        root = self.dataset(mode, task)
        rows = read_episodes(root) if (root / "meta" / "episodes").is_dir() else []  # else none was saved
        if any(not {"participant", "trial"} <= set(row) for row in rows):
            raise HandrailError(f"dataset {str(root)!r}: expected trials of a user study, got other episodes")
        return rows

    def forget(self, name: str) -> None:
        """Remove the files of a participant, all at once."""
        with explained(f"cannot remove {str(self.place(name))!r}"):
            os.replace(self.place(name), self._forgotten)
            sync_folder(self._participants)
            remove(self._forgotten)

    def settle(self, study: UserStudy) -> None:
        """Finish what an erasure that was cut short has left behind; whoever holds the lock may."""
        with explained(f"cannot write {str(self.root)!r}"):
            remove(self._forgotten)
            for mode in study.modes:
                for task in study.tasks:
                    settle(self.dataset(mode, task))

    def left(self, study: UserStudy, who: Participant) -> list[Step]:
        """Return what a participant has still to do."""
        steps = plan(study, who.slot)
        done = who.finished()
        for mode in study.modes:
            for task in study.tasks:
                if practice_is_over(study.practice, who.practised_so_far(mode, task)):
                    done.add(Step("practice", mode, task).key)
                rows = self.episodes(mode, task)
                done |= {f"{mode}/{task}/{row['trial']}" for row in rows if row["participant"] == who.name}
        return remaining(steps, done)

    def _content(self) -> dict[str, Any]:
        if not self._written.exists():
            raise HandrailError(
                f"{str(self.root)!r}: expected a folder with study.toml, found none;"
                f" write one: handrail-user-study new {self.root}"
            )
        return read_toml(self._written, "study")
