"""Hours of Handrail's own commands with faults: `python tests/soak/soak.py OUT --hours 2`.

Every round adds a line to OUT/rounds.jsonl. A new start goes on with further seeds.
"""

import argparse
import json
import os
import subprocess
import sys
import time
import traceback
from datetime import UTC, datetime
from pathlib import Path

from child import hear_signals
from notes import commit, next_number, note
from rounds import run_round
from workshop import Workshop

ROUNDS = "rounds.jsonl"


def main() -> None:
    """Run rounds until time is over."""
    says = argparse.ArgumentParser(description=__doc__)
    says.add_argument("out", type=Path, help="folder for what happened, and for scratch")
    says.add_argument("--hours", type=float, default=2.0, help="for how long")
    says.add_argument("--rounds", type=int, default=10**9, help="how many at most")
    says.add_argument("--fault", default="", help="only faults with this in their name")
    says.add_argument("--work", default="", help="only this kind of work")
    says.add_argument("--drive", action="store_true", help="also drive in the browser, all the time")
    says.add_argument("--seed", type=int, default=0, help="of the rounds; two may run at once")
    given = says.parse_args()
    hear_signals()
    out = given.out.absolute()
    os.nice(19)
    driving = [sys.executable, str(Path(__file__).with_name("driving.py")), str(out)]
    if given.drive:
        subprocess.Popen([*driving, "--hours", str(given.hours)], start_new_session=True)
    workshop = Workshop(out / "workshop")
    until, first = time.monotonic() + 3600.0 * given.hours, next_number(out / ROUNDS, given.seed)
    for number in range(first, first + given.rounds):
        if time.monotonic() > until:
            break
        scratch = out / f"round-{given.seed}-{number}"
        begun = datetime.now(UTC).isoformat(timespec="seconds")
        try:
            row = run_round(number, given.seed, scratch, workshop, given.fault, given.work)
        except Exception:  # of the soak itself: said, and on it goes
            row = {"round": number, "seed": given.seed, "broken": traceback.format_exc(limit=4)}
        row |= {"begun": begun, "commit": commit(), "load": round(os.getloadavg()[0], 1)}
        note(out / ROUNDS, row)
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
