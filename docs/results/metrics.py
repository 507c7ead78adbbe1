"""Say which quality metric of demonstrations goes with the success of policies.

`python docs/results/metrics.py STUDY.json …`. Spearman's ρ of a metric of a recording and the success of
the policy that learnt from it, over modes and draws of a study, a task and an amount of data; ρ is the mean
over these, without those in which the metric or success does not vary. Its interval: 95 % of ρ over modes
drawn anew with their draws. p: how often some metric has a larger |ρ| where success is given to modes by
chance, so that it holds for all metrics together. Modes are chosen once for all groups: amounts of a task
share recordings. Policies that an earlier study has, too, are left out. Explores: modes differ in more than
one metric, and m of them give no p below 1 / m!, nor a sure interval.
"""

import json
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
from scipy import stats

TIMES = 2000
ALONE = {  # each recording by itself: no common scale, or another controller's limits
    *("action_variance", "information", "state_coverage", "saturation", "slack_used"),
    *("input_effort", "input_reversals", "active_axes", "input_idle"),
}


def read(files):
    """Return metrics and success, draw by draw, of each mode of each group of policies."""
    found, before = defaultdict(dict), set()
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
            success = [each["draws"][draw] for draw in draws]
            own = {
                json.dumps([each["task"], each["label"], *pair])
                for pair in zip(recorded, success, strict=True)
            }
            if not own <= before:
                found[Path(file).stem, each["task"], amount][mode] = recorded, success
            before |= own
    return {name: group for name, group in found.items() if len(group) > 2}


def correlation(metric, success):
    """Return Spearman's ρ of two tables, (modes, draws) each; NaN where one does not vary."""
    if not (np.ptp(metric) > 0.0 and np.ptp(success) > 0.0):
        return np.nan
    one, other = (ranks - ranks.mean() for ranks in map(stats.rankdata, (metric.ravel(), success.ravel())))
    return float(one @ other / np.sqrt((one @ one) * (other @ other)))


def main(*files):
    """Print a line for each metric, the one that goes best with success first."""
    groups, rng = read(files), np.random.default_rng(0)
    if not groups:
        sys.exit("expected three modes with all draws of a task, got fewer")
    every = [recorded for group in groups.values() for recorded, _ in group.values()]
    names = sorted(set.intersection(*(set(draw) for recorded in every for draw in recorded)) - ALONE)
    modes = sorted({mode for group in groups.values() for mode in group})

    def correlations(measured, succeeded):
        """Return each group's ρ: modes whose metrics count, and those whose success stands for it."""
        every = []
        for group in groups.values():
            first, second = ([mode for mode in order if mode in group] for order in (measured, succeeded))
            success = np.array([group[mode][1] for mode in second])
            metrics = np.array([[[row[name] for name in names] for row in group[mode][0]] for mode in first])
            each = [correlation(metrics[..., k], success) if first else np.nan for k in range(len(names))]
            every.append(each)
        return np.array(every)

    def mean(measured, succeeded):
        found = correlations(measured, succeeded)
        with np.errstate(invalid="ignore"):
            return np.nansum(found, axis=0) / np.isfinite(found).sum(axis=0)

    counts = np.isfinite(correlations(modes, modes)).sum(axis=0)
    if not counts.any():
        sys.exit("expected success that differs between policies, got the same of all")
    names = [name for name, count in zip(names, counts, strict=True) if count]
    counts = counts[counts > 0]
    found = mean(modes, modes)
    again = np.array([mean(order, order) for order in rng.choice(modes, (TIMES, len(modes)))])
    chance = np.array([np.abs(mean(modes, rng.permutation(modes))).max() for _ in range(TIMES)])
    low, high = np.nanquantile(again, (0.025, 0.975), axis=0)
    policies = sum(len(success) for group in groups.values() for _, success in group.values())
    print(f"{len(groups)} groups, {policies} policies")
    for k in np.argsort(-np.abs(found)):
        p = (1 + np.sum(chance >= abs(found[k]) - 1e-9)) / (1 + TIMES)
        some = f" ({counts[k]} of {len(groups)} groups)" * bool(counts[k] < len(groups))
        print(
            f"{names[k]}: {found[k]:+.2f} ({low[k]:+.2f} to {high[k]:+.2f}), p over all metrics {p:.3f}{some}"
        )


if missing := [name for name in sys.argv[1:] if not Path(name).is_file()]:
    sys.exit(f"expected files, got {', '.join(missing)}")
if len(sys.argv) < 2:
    sys.exit("expected STUDY.json …")
main(*sys.argv[1:])
