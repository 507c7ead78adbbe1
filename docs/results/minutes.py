"""Say how much longer one mode has to be driven than another until its policies are as good.

`python docs/results/minutes.py ARCHIVE.tar.xz ONE OTHER …`. In a task, of a policy of mode m that learnt from
an amount x, `logit P(success) = α_m + β ln x` for both modes, by maximum likelihood. At equal success the
other's amount over that of the one is `ratio = exp((α_one − α_other) / β)`. Its interval: Student's t over
draws. The standard error of ln ratio is a jackknife's that leaves out a draw at a time, at least that of the
rollouts by chance. There is no ratio unless β is above 0 by such an interval of its own. With a β for each
mode, it is tested whether they differ. A draw counts if it has all amounts of both modes. Amounts are the
operator's minutes, failed demonstrations included, and numbers of successful demonstrations. Explores.
"""

import json
import sys
import tarfile
from collections import defaultdict
from itertools import product
from pathlib import Path

import numpy as np
from scipy import optimize, special, stats

AMOUNTS = {"minutes": "operator_time", "demonstrations": "episodes"}


def read(archive):
    """Return (amounts by name, successes, rollouts) of each policy by (task, mode), draw and data."""
    found = defaultdict(lambda: defaultdict(lambda: defaultdict(list)))
    with tarfile.open(archive) as files:
        for each in files:
            _, *parts = each.name.removeprefix("./").removesuffix(".json").split("/")
            file = files.extractfile(each)
            if file and "/nominal/" in each.name and parts[-1].startswith("realised-time"):
                task, mode, draw, *_, data = parts
                (arm,) = json.load(file)["arms"].values()
                for run in arm:
                    success = [rollout["success"] for rollout in run["rollouts"]]
                    amounts = {name: run["trained_on"][key] for name, key in AMOUNTS.items()}
                    found[task, mode][int(draw)][data].append((amounts, sum(success), len(success)))
    return found


def fit(name, sides, draws, parameters=3):
    """Return (middle, α_one − α_other, β, a fourth: by how much β differs) and their covariance by chance."""
    rows = [
        (sign, np.log(amounts[name]), k, n)
        for sign, side in zip((0.5, -0.5), sides, strict=True)
        for draw in draws
        for policies in side[draw].values()
        for amounts, k, n in policies
    ]
    sign, amount, success, count = np.array(rows).T
    amount = amount - amount.mean()
    table = np.stack([np.ones_like(sign), sign, amount, sign * amount][:parameters], axis=1)
    weight = 0.02  # of a prior, of the order of one rollout: all or none is finite

    def loss(at):
        value = table @ at
        return np.sum(count * np.logaddexp(0.0, value) - success * value) + 0.5 * weight * at @ at

    def gradient(at):
        return table.T @ (count * special.expit(table @ at) - success) + weight * at

    best = optimize.minimize(loss, np.zeros(parameters), jac=gradient, method="BFGS").x
    share = special.expit(table @ best)
    certain = (table.T * (count * share * (1 - share))) @ table + weight * np.eye(parameters)
    return best, np.linalg.inv(certain)


def standard_error(left_out, variance):
    """Return the jackknife's standard error, at least that by chance."""
    return np.sqrt(max((len(left_out) - 1) * np.var(left_out), variance))


def answer(name, sides, draws):
    """Return the ratio with its interval and what speaks against it, or that there is none."""
    rest = [[draw for draw in draws if draw != out] for out in draws]
    (_, apart, slope), chance = fit(name, sides, draws)
    _, aparts, slopes = np.transpose([fit(name, sides, each)[0] for each in rest])
    bound = stats.t.ppf(0.975, len(draws) - 1)
    if slope <= bound * standard_error(slopes, chance[2, 2]):
        return ": success does not clearly rise with it, no ratio"
    by = np.array([0.0, 1 / slope, -apart / slope**2])
    half, middle = bound * standard_error(aparts / slopes, by @ chance @ by), apart / slope
    low, mean, high = np.exp([middle - half, middle, middle + half])
    (*_, differ), chance = fit(name, sides, draws, 4)
    differs = [fit(name, sides, each, 4)[0][3] for each in rest]
    amounts = [
        row[0][name] for side in sides for draw in draws for rows in side[draw].values() for row in rows
    ]
    beyond = abs(middle) + half > np.log(max(amounts) / min(amounts))
    bent = abs(differ) > bound * standard_error(differs, chance[3, 3])
    limits = [", beyond the amounts driven"] * bool(beyond) + [", lines are not parallel"] * bool(bent)
    return f" {mean:.2f} ({low:.2f} to {high:.2f}){''.join(limits)}"


def highest(side, draws):
    """Return the mean success of the amount of data where it is highest [%]."""
    rows = [[row for draw in draws for row in side[draw][data]] for data in side[draws[0]]]
    return 100 * max(np.mean([k / n for _, k, n in each]) for each in rows)


def whole(sides):
    """Return draws in which both modes have every amount of data that any draw has, and how many are not."""
    data = [{each for draw in side.values() for each in draw} for side in sides]
    begun = sorted({draw for side in sides for draw in side}) if all(data) else []  # else a mode is not there
    kept = [d for d in begun if [side.get(d, {}).keys() for side in sides] == data]
    return kept, len(begun) - len(kept)


def lacks(sides, draws, modes):
    """Return why there is no answer, if there is none."""
    if len(draws) < 2:
        return f": expected two whole draws or more of {' and '.join(modes)}, got {len(draws)}"
    for mode, side in zip(modes, sides, strict=True):
        driven = [[row[0]["minutes"] for rows in side[draw].values() for row in rows] for draw in draws]
        if any(max(each) < 1.5 * min(each) for each in driven):
            return f", {mode}: expected policies of several amounts of data, got one"
    return ""


def main(archive, one, *others):
    """Print a line for each task, amount and other mode."""
    found, told, lacking = read(archive), False, []
    if not found:
        sys.exit("expected undisturbed policies of realised motion, got none")
    for task, other in product(sorted({task for task, _ in found}), others):
        modes, sides = (one, other), (found[task, one], found[task, other])
        draws, partial = whole(sides)
        if why := lacks(sides, draws, modes):
            lacking.append(task + why)
            continue
        told = True
        reached = [f"{mode} {highest(side, draws):.0f} %" for mode, side in zip(modes, sides, strict=True)]
        count = f"{len(draws)} draws" + f" ({partial} not whole)" * bool(partial)
        for name in AMOUNTS:
            said = answer(name, sides, draws)
            print(f"{task}, {name}: {other} / {one}{said}, {count}; highest success {', '.join(reached)}")
    if not told:
        sys.exit("; ".join(lacking))
    for each in lacking:
        print(each)


if missing := [name for name in sys.argv[1:2] if not Path(name).is_file()]:
    sys.exit(f"expected a file, got {', '.join(missing)}")
if len(sys.argv) < 4:
    sys.exit("expected ARCHIVE.tar.xz ONE OTHER …: an archive and two modes")
main(*sys.argv[1:])
