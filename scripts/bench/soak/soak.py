"""Hours of Handrail's own commands with faults."""

import json
import os
import subprocess
import sys
import time
import traceback
from datetime import UTC, datetime
from pathlib import Path

from handrail.datasets.presentation.terminal import Terminal
from handrail.scripts.bench.soak.child import hear_signals
from handrail.scripts.bench.soak.config import SoakConfig
from handrail.scripts.bench.soak.notes import ROUNDS, next_number, note, write_tables
from handrail.scripts.bench.soak.rounds import run_round
from handrail.scripts.bench.soak.work import Workshop


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
