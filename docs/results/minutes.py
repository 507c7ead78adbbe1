"""Say how much longer one mode has to be driven than another until its policies are as good.

`python docs/results/minutes.py ARCHIVE.tar.xz ONE OTHER …`. In a task, of a policy of mode m that learnt from
an amount x, `logit P(success) = α_m + β ln x` for both modes, by maximum likelihood. At equal success the
other's amount over that of the one is `ratio = exp((α_one − α_other) / β)`. Its interval: Student's t over
draws, of ln ratio with one draw left out at a time (jackknife). Amounts are the operator's minutes, failed
demonstrations included, and numbers of successful demonstrations. Explores; that lines are not parallel is
not seen.
"""

import json
import sys
import tarfile
from collections import defaultdict
from pathlib import Path

import numpy as np
from scipy import optimize, stats

AMOUNTS = {"minutes": "operator_time", "demonstrations": "episodes"}


def read(archive):
    """Return (amounts by name, successes, rollouts) of each policy by (task, mode) and draw."""
    found = defaultdict(lambda: defaultdict(list))
    with tarfile.open(archive) as files:
        for each in files:
            _, *parts = each.name.removeprefix("./").removesuffix(".json").split("/")
            file = files.extractfile(each)
            if file and "/nominal/" in each.name and parts[-1].startswith("realised-time"):
                task, mode, draw, *_ = parts
                (arm,) = json.load(file)["arms"].values()
                for run in arm:
                    success = [rollout["success"] for rollout in run["rollouts"]]
                    amounts = {name: run["trained_on"][key] for name, key in AMOUNTS.items()}
                    found[task, mode][int(draw)].append((amounts, sum(success), len(success)))
    return found


def log_ratio(name, sides, draws):
    """Return ln ratio of an amount, from the policies of both modes in some draws."""
    policies = [
        (sign, row) for sign, side in zip((0.5, -0.5), sides, strict=True) for d in draws for row in side[d]
    ]
    rows = [(sign, np.log(amounts[name]), k, n) for sign, (amounts, k, n) in policies]
    sign, amount, success, count = np.array(rows).T
    amount = amount - amount.mean()

    def loss(parameters):
        middle, apart, slope = parameters
        value = middle + apart * sign + np.exp(slope) * amount
        prior = 0.01 * (middle**2 + apart**2 + slope**2)  # of the order of one rollout: all or none is finite
        return np.sum(count * np.logaddexp(0.0, value) - success * value) + prior

    _, apart, slope = optimize.minimize(loss, np.zeros(3), method="BFGS").x
    return apart / np.exp(slope)


def main(archive, one, *others):
    """Print a line for each task, amount and other mode."""
    found = read(archive)
    for task in sorted({task for task, _ in found}):
        for other in others:
            sides = found[task, one], found[task, other]
            draws = sorted(set(sides[0]) & set(sides[1]))
            for mode, side in zip((one, other), sides, strict=True):
                driven = [[amounts["minutes"] for amounts, *_ in side[draw]] for draw in draws]
                if any(max(each) < 1.5 * min(each) for each in driven):
                    sys.exit(f"{task}, {mode}: expected policies of several amounts of data, got one")
            if len(draws) < 2:
                sys.exit(f"{task}: expected two draws or more of {one} and {other}, got {len(draws)}")
            for name in AMOUNTS:
                every, count = log_ratio(name, sides, draws), len(draws)
                left_out = [log_ratio(name, sides, [draw for draw in draws if draw != out]) for out in draws]
                error = np.sqrt((count - 1) * np.var(left_out))
                half = stats.t.ppf(0.975, count - 1) * error
                low, mean, high = np.exp([every - half, every, every + half])
                print(f"{task}, {name}: {other} / {one} {mean:.2f} ({low:.2f} to {high:.2f}), {count} draws")


if missing := [name for name in sys.argv[1:2] if not Path(name).is_file()]:
    sys.exit(f"expected a file, got {', '.join(missing)}")
if len(sys.argv) < 4:
    sys.exit("expected ARCHIVE.tar.xz ONE OTHER …: an archive and two modes")
main(*sys.argv[1:])
