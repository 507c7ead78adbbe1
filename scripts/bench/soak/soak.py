"""Hours of Handrail's own commands with faults."""

import json
import os
import subprocess
import sys
import time
import traceback
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import tyro
from msgspec import Meta

from handrail.collect.flags import check_file
from handrail.controllers.errors import HandrailError, check_known
from handrail.controllers.typed import Count, check_settings
from handrail.datasets.presentation.terminal import Terminal
from handrail.scripts.bench.soak.child import hear_signals
from handrail.scripts.bench.soak.faults import FAULTS
from handrail.scripts.bench.soak.notes import ROUNDS, next_number, note, write_tables
from handrail.scripts.bench.soak.rounds import run_round
from handrail.scripts.bench.soak.work import KINDS, Workshop


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
        check_file("--page", self.page, ".md")
        check_known("--work", [self.work] if self.work else [], KINDS)
        if not any(self.fault in each.name and each.is_possible for each in FAULTS):
            raise HandrailError(
                f"--fault {self.fault}: expected a part of a name in faults.py, possible here"
            )
        if self.folder.is_file():
            raise HandrailError(f"OUTPUT {self.output}: expected a folder, found a file")


def main(config: SoakConfig) -> int:
    """Run rounds until time is over."""
    hear_signals()
    out = config.folder
    os.nice(19)
    if config.drive:
        driving = [sys.executable, "-m", "handrail.scripts.bench.soak.driving", str(out), str(config.hours)]
        subprocess.Popen(driving, start_new_session=True)
    workshop = Workshop(out / "workshop")
    until, first = time.monotonic() + 3600.0 * config.hours, next_number(out / ROUNDS, config.seed)
    for number in range(first, first + config.rounds):
        if time.monotonic() > until:
            break
        scratch = out / f"round-{config.seed}-{number}"
        begun = datetime.now(UTC).isoformat(timespec="seconds")
        try:
            row = run_round(number, config.seed, scratch, workshop, config.fault, config.work)
        except Exception:  # of the soak itself: noted, and the next round begins
            row = {"round": number, "seed": config.seed, "broken": traceback.format_exc(limit=4)}
        row["begun"] = begun
        note(out / ROUNDS, row)
        Terminal().print(json.dumps(row))
    if config.page:
        write_tables(out, Path(config.page).expanduser())
    return 0
