"""Settings of the soak; light to import."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from msgspec import Meta

from handrail.collect.flags import check_page
from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import Count, check_settings


@dataclass(frozen=True)
class SoakConfig:
    """Let faults befall Handrail's own commands for hours; a new start goes on with further seeds."""

    output: tyro.conf.Positional[str] = "outputs/soak"
    """Folder of the results: every round adds a line to rounds.jsonl."""
    hours: Annotated[float, Meta(ge=0, le=1000)] = 2.0
    """Duration [h]."""
    rounds: Count = 10**9
    """Most rounds."""
    fault: str = ""
    """Only faults with this in their name."""
    work: str = ""
    """Only this kind of work."""
    drive: bool = False
    """Also drive in the browser, all the time."""
    seed: Count = 0
    """Of the rounds; two may run at once."""
    page: str = ""
    """Put the tables of all rounds into this Markdown page, at the end."""

    @property
    def folder(self) -> Path:
        """The folder of the results."""
        return Path(self.output).expanduser().absolute()

    def check(self) -> None:
        """Check the settings."""
        check_settings(self, "--")
        check_page(self.page)
        if self.folder.is_file():
            raise HandrailError(f"OUTPUT {self.output}: expected a folder, found a file")
