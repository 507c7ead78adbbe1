"""Compute what a study declared anew from its archive, without Handrail.

`python docs/results/recompute.py ARCHIVE.tar.xz DESIGN.toml`. Of a policy in a draw the share s of its
rollouts that succeed; a contrast is Σ w s, its mean over tasks the replicate. Student's t over draws, whose
variance is at least Σ w² p (1 − p) / R, that of R rollouts by chance, with p of all draws after two successes
and two failures more. Holm over the declared contrasts; where there is a margin, two one-sided t tests.
"""

import json
import sys
import tarfile
import tomllib
from collections import defaultdict
from pathlib import Path

import numpy as np
from scipy import stats

CELLS = ("hand_mpc", "hand_none", "joint_mpc", "joint_none")
SIGNS = {
    "input": (0.5, 0.5, -0.5, -0.5),
    "controller": (0.5, -0.5, 0.5, -0.5),
    "interaction": (1, -1, -1, 1),
}


def read(archive):
    """Return each rollout's success by (task, mode, kind of policy) and draw; undisturbed ones alone."""
    found = defaultdict(dict)
    with tarfile.open(archive) as files:
        for each in files:
            _, *parts = each.name.removeprefix("./").removesuffix(".json").split("/")
            file = files.extractfile(each)
            if file and "/nominal/" in each.name:
                task, mode, draw, _, kind = parts
                (arm,) = json.load(file)["arms"].values()
                success = [rollout["success"] for run in arm for rollout in run["rollouts"]]
                found[task, mode, kind][int(draw)] = np.array(success, float)
    return found


def declared(design):
    """Yield the words, the weights by (mode, kind of policy) and the margin of each contrast."""
    for pair in design.get("pairs", ()):
        kind = f"realised-{pair.get('budget', 'time')}"
        weights = {(pair["one"], kind): 1, (pair["other"], kind): -1}
        words = f"{pair['one']} − {pair['other']}" + " (same number)" * (kind == "realised-number")
        yield words, weights, pair.get("margin")
    factors, rounds = design.get("factors", {}), design.get("rounds", {})
    for name in factors.get("primary", ()):
        modes = [(factors[cell], "realised-time") for cell in CELLS]
        yield name, dict(zip(modes, SIGNS[name], strict=True)), None
    for pair in rounds.get("primary", ()):
        modes = [(f"{way}-{rounds['count']}", "intent-time") for way in pair]
        yield " − ".join(pair), dict(zip(modes, (1, -1), strict=True)), None


def estimate(weights, rollouts):
    """Return mean, standard error and number of draws of a contrast of some policies."""
    draws = sorted(set.intersection(*(set(rollouts[policy]) for policy in weights)))
    values = [sum(w * rollouts[policy][draw].mean() for policy, w in weights.items()) for draw in draws]
    least = 0.0
    for policy, weight in weights.items():
        every = np.concatenate(list(rollouts[policy].values()))
        p = (every.sum() + 2) / (len(every) + 4)
        least += weight**2 * p * (1 - p) * len(rollouts[policy]) / len(every)
    return np.mean(values), np.sqrt(max(np.var(values, ddof=1), least) / len(values)), len(values)


def main(archive, preset):
    """Print a line for each contrast."""
    with open(preset, "rb") as file:
        design = tomllib.load(file)
    rollouts, rows = read(archive), []
    for words, weights, margin in declared(design):
        tasks = design["tasks"]
        spread = {(task, *which): w / len(tasks) for task in tasks for which, w in weights.items()}
        if any(set(rollouts[policy]) != set(range(design["draws"])) for policy in spread):
            sys.exit(
                f"{words}: expected {design['draws']} draws of each policy, found fewer: nothing is tested"
            )
        mean, error, count = estimate(spread, rollouts)
        half = stats.t.ppf(0.975, count - 1) * error
        low, high = mean - half, mean + half
        line = f"{words}: {100 * mean:+.3f} ({100 * low:+.3f} to {100 * high:+.3f}), {count} draws"
        if margin:
            p = max(stats.t.sf((margin + sign * mean) / error, count - 1) for sign in (1, -1))
            line += f", equivalence within {100 * margin:g}: p {p:.6f}"
        rows.append((2 * stats.t.sf(abs(mean) / error, count - 1), line))
    holm = 0.0
    for rank, (p, line) in enumerate(sorted(rows)):
        holm = max(holm, min(1.0, (len(rows) - rank) * p))
        print(f"{line}, p {p:.6f}, after Holm {holm:.6f}")


if missing := [name for name in sys.argv[1:] if not Path(name).is_file()]:
    sys.exit(f"expected files, got {', '.join(missing)}")
if len(sys.argv) != 3:
    sys.exit("expected ARCHIVE.tar.xz DESIGN.toml")
main(*sys.argv[1:])
