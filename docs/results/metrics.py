"""Say which quality metric of demonstrations goes with the success of policies.

`python docs/results/metrics.py STUDY.json …`. Spearman's ρ of a metric of a recording and the success of
the policy that learnt from it, over modes and draws of a study, a task and an amount of data; ρ is the mean
over these. Its interval: 95 % of ρ over modes drawn anew with their draws. p: how often some metric has a
larger |ρ| where success is given to modes by chance, so that it holds for all metrics together. Explores:
modes differ in more than one metric.
"""

import json
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
from scipy import stats

TIMES = 2000


def read(files):
    """Return metrics, (modes, draws, metrics), and success, (modes, draws), of each group of policies."""
    found = defaultdict(dict)
    for file in files:
        study = json.loads(Path(file).read_text())
        quality = {tuple(job.split("/")[1:]): each["result"] for job, each in study["jobs"].items()}
        draws = [str(draw) for draw in range(study["design"]["draws"])]
        for each in study["conditions"]:
            mode, _, amount = each["label"].partition(" ")
            recorded = [quality.get((each["task"], mode, draw), {}).get("quality") for draw in draws]
            if (
                "intent" in amount
                or each["treatment"]
                or not all(recorded)
                or each["draws"].keys() < {*draws}
            ):
                continue
            group = found[Path(file).stem, each["task"], amount]
            group[mode] = recorded, [each["draws"][draw] for draw in draws]
    return {name: group for name, group in found.items() if len(group) > 2}


def correlation(metric, success):
    """Return Spearman's ρ of two tables, (modes, draws) each; 0 where nothing varies."""
    if not (np.ptp(metric) > 0.0 and np.ptp(success) > 0.0):
        return 0.0
    one, other = (ranks - ranks.mean() for ranks in map(stats.rankdata, (metric.ravel(), success.ravel())))
    return float(one @ other / np.sqrt((one @ one) * (other @ other)))


def main(*files):
    """Print a line for each metric, the one that goes best with success first."""
    groups, rng = read(files), np.random.default_rng(0)
    every = [recorded for group in groups.values() for recorded, _ in group.values()]
    names = sorted(set.intersection(*(set(draw) for recorded in every for draw in recorded)))
    tables = [
        (
            np.array(
                [[[draw[name] for name in names] for draw in recorded] for recorded, _ in group.values()]
            ),
            np.array([success for _, success in group.values()]),
        )
        for group in groups.values()
    ]

    def mean(choose):
        """Return each metric's ρ with the modes of each group that are chosen, for metric and success."""
        chosen = [
            (metrics[one], success[other])
            for metrics, success in tables
            for one, other in [choose(len(success))]
        ]
        every = [
            [correlation(metrics[..., k], success) for k in range(len(names))] for metrics, success in chosen
        ]
        return np.mean(every, axis=0)

    def drawn(count):
        modes = rng.integers(count, size=count)
        return modes, modes

    found = mean(lambda count: (np.arange(count), np.arange(count)))
    again = np.array([mean(drawn) for _ in range(TIMES)])
    chance = np.array(
        [np.abs(mean(lambda n: (np.arange(n), rng.permutation(n)))).max() for _ in range(TIMES)]
    )
    low, high = np.quantile(again, (0.025, 0.975), axis=0)
    print(f"{len(tables)} groups, {sum(success.size for _, success in tables)} policies")
    for k in np.argsort(-np.abs(found)):
        p = (1 + np.sum(chance >= abs(found[k]) - 1e-9)) / (1 + TIMES)
        print(f"{names[k]}: {found[k]:+.2f} ({low[k]:+.2f} to {high[k]:+.2f}), p over all metrics {p:.3f}")


if missing := [name for name in sys.argv[1:] if not Path(name).is_file()]:
    sys.exit(f"expected files, got {', '.join(missing)}")
if len(sys.argv) < 2:
    sys.exit("expected STUDY.json …")
main(*sys.argv[1:])
