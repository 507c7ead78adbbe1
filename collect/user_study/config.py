"""Settings of `handrail-user-study`; light to import."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import tyro

from handrail.collect.cockpit_config import CockpitConfig
from handrail.controllers.errors import HandrailError

Verb = Literal["new", "run", "status", "export", "erase"]
_OF_SOMEBODY = ("run", "erase")


@dataclass(frozen=True)
class StudySessionConfig:
    """Lead people through a user study: consent, practice, trials in the cockpit, forms such as NASA-TLX."""

    verb: tyro.conf.Positional[Verb]
    """new: write a study's file to begin with. run: lead a participant through what is left of their session.
    status: print how far each participant is. export: write the tables. erase: remove a participant and all
    that is theirs."""
    place: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FOLDER")]
    """Folder of the study."""
    participant: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="PARTICIPANT")] = ""
    """Id of the participant, for run and erase, such as P001; it says nothing of the person."""
    cockpit: CockpitConfig = field(default_factory=CockpitConfig)

    @property
    def folder(self) -> Path:
        """The study's folder."""
        return Path(self.place).expanduser()

    def check(self) -> None:
        """Check the settings."""
        self.cockpit.check()
        if self.verb in _OF_SOMEBODY and not self.participant:
            raise HandrailError(f"{self.verb}: expected a participant, such as P001, after the folder")
        if self.verb not in _OF_SOMEBODY and self.participant:
            raise HandrailError(f"{self.verb}: expected a folder alone, got {self.participant} too")
        if self.folder.exists() and not self.folder.is_dir():
            raise HandrailError(f"{self.place}: expected a folder, found a file")
