"""Say when policies touched something first: on their way, or after they were lost.

`python docs/results/contacts.py ARCHIVE.tar.xz`. A policy is lost at its first contact if in the 5 s before
the distance d of the hand to where it is to go, told each second, fell by less than 2 cm:
`d(t − 5 s) − d(t) < 0.02 m`; not if that place changed meanwhile, so that d rose by more than 10 cm in a
second. Undisturbed rollouts, by task and kind of policy. Explores; chosen before any rollout was looked at.
"""

import json
import sys
import tarfile
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np

WINDOW, PROGRESS, JUMP = 5, 0.02, 0.1  # [s], [m], [m]


def kind(rollout):
    """Return `none`, `on the way`, or `lost`: of the first contact."""
    if not rollout["contacts"]:
        return "none"
    if not {"distances", "first_contact"} <= rollout.keys():
        sys.exit("expected rollouts that say `distances` and `first_contact`, got others: of an older study")
    distances = np.array(rollout["distances"][: int(rollout["first_contact"]) + 1])
    recent = distances[-WINDOW - 1 :]
    if len(recent) <= WINDOW or np.diff(recent).max() > JUMP or recent[0] - recent[-1] >= PROGRESS:
        return "on the way"
    return "lost"


def main(archive):
    """Print a line for each task and kind of policy."""
    found = defaultdict(Counter)
    with tarfile.open(archive) as files:
        for each in files:
            file = files.extractfile(each)
            if file and "/nominal/" in each.name:
                task = each.name.removeprefix("./").split("/")[1]
                for label, runs in json.load(file)["arms"].items():
                    for rollout in (rollout for run in runs for rollout in run["rollouts"]):
                        found[task, label][kind(rollout), bool(rollout["success"])] += 1
    for (task, label), counts in found.items():
        ways = {way: sum(counts[way, success] for success in (True, False)) for way in ("on the way", "lost")}
        anyway = counts["on the way", True] + counts["lost", True]
        print(
            f"{task}, {label}: of {counts.total()} rollouts {sum(ways.values())} touched something,"
            f" {ways['on the way']} on the way, {ways['lost']} after they were lost; {anyway} succeeded"
        )


if len(sys.argv) != 2 or not Path(sys.argv[1]).is_file():
    sys.exit(f"expected ARCHIVE.tar.xz, got {' '.join(sys.argv[1:]) or 'nothing'}")
main(sys.argv[1])
