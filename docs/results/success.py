"""Draw the success of policies over the operator's minutes, all modes of several studies in one figure.

`python docs/results/success.py FIGURE.png ARCHIVE.tar.xz …`. A point is a mode with an amount of data in one
study: the mean over draws, and 95 % by Student's t over these, whose variance is at least that of a draw's
rollouts by chance; one draw has none. Amounts of the same recordings are joined; policies that an earlier
study has are drawn once. Tasks are in the order of
their least minutes, modes in that of their highest success. It also prints the points.
"""

import json
import sys
import tarfile
from collections import defaultdict
from itertools import cycle
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator
from scipy import stats

MARKS = "osD^v"  # a study each, and a colour a mode
COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#5b4b8a", "#7f7f7f"]
COLOURS += ["#882255", "#999933"]


def read(archive):
    """Return (minutes, successes, rollouts) of each draw by (task, mode) and amount; undisturbed ones."""
    found = defaultdict(lambda: defaultdict(list))
    with tarfile.open(archive) as files:
        for each in files:
            _, *parts = each.name.removeprefix("./").removesuffix(".json").split("/")
            file = files.extractfile(each)
            if file and "/nominal/" in each.name and parts[-1].startswith("realised-time"):
                task, mode, *_, kind = parts
                ((run,),) = json.load(file)["arms"].values()
                success = [rollout["success"] for rollout in run["rollouts"]]
                minutes = run["trained_on"]["operator_time"] / 60.0
                found[task, mode][kind].append((minutes, sum(success), len(success)))
    return found


def point(draws):
    """Return minutes, and success in percent with the ends of its interval, from a policy a draw."""
    minutes, successes, rollouts = np.transpose(draws)
    share, p = successes / rollouts, (successes.sum() + 2) / (rollouts.sum() + 4)
    if len(share) < 2:
        return minutes.mean(), 100 * share.mean(), np.nan, np.nan
    error = np.sqrt(max(share.var(ddof=1), p * (1 - p) / rollouts.mean()) / len(share))
    ends = share.mean() + stats.t.ppf((0.025, 0.975), len(share) - 1) * error
    return minutes.mean(), 100 * share.mean(), *(100 * ends.clip(0.0, 1.0))


def main(figure, *archives):
    """Draw one panel a task, and print a line for each point."""
    studies = [read(archive) for archive in archives]
    if not all(studies):
        sys.exit("expected undisturbed policies of realised motion, got none")
    drawn_before = set()  # a study in a copy of another's folder has policies of it, too
    for study in studies:
        for (task, mode), kinds in list(study.items()):
            own = {(task, mode, *draw) for draws in kinds.values() for draw in draws}
            if own <= drawn_before:
                del study[task, mode]
            drawn_before |= own
    points = [
        {key: sorted((*point(draws), len(draws)) for draws in kinds.values()) for key, kinds in study.items()}
        for study in studies
    ]
    least, best = defaultdict(list), defaultdict(list)
    for each in points:
        for (task, mode), rows in each.items():
            least[task].append(rows[0][0])
            best[mode].append(-max(row[1] for row in rows))
    tasks, modes = (sorted(found, key=lambda name: min(found[name])) for found in (least, best))
    drawn = Figure((5.2 * len(tasks), 4.2), layout="constrained")
    for axes, task in zip(np.atleast_1d(drawn.subplots(1, len(tasks), sharey=True)), tasks, strict=True):
        for mark, study in zip(cycle(MARKS), points, strict=False):
            for mode in (mode for mode in modes if (task, mode) in study):
                x, y, low, high, _ = np.transpose(study[task, mode])
                name = mode if mode not in axes.get_legend_handles_labels()[1] else None
                colour = COLOURS[modes.index(mode) % len(COLOURS)]
                style = {"color": colour, "marker": mark, "ms": 5, "capsize": 2}
                beside = x * np.exp(0.015 * (modes.index(mode) - len(modes) / 2))  # side by side
                axes.errorbar(beside, y, (y - low, high - y), label=name, **style)
                for minutes, share, *ends, count in study[task, mode]:
                    span = " to ".join(f"{end:.1f}" for end in ends)
                    sure = f"({span}), {count} draws" if count > 1 else "(one draw)"
                    print(f"{task}, {mode}: {minutes:.1f} min {share:.1f} % {sure}")
        for mark, archive in zip(cycle(MARKS), archives if len(archives) > 1 else (), strict=False):
            name = Path(archive).name.removesuffix(".tar.xz")
            axes.plot([], [], mark, color="0.5", ms=5, label=name)
        axes.set(title=task.replace("_", " "), xlabel="operator's time [min]", ylim=(-3, 103), xscale="log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 1.5, 2.0, 3.0, 5.0)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.minorticks_off()
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, fontsize=8)
    drawn.axes[0].set_ylabel("policy success [%], 95 %")
    drawn.savefig(figure, dpi=110)


if missing := [name for name in sys.argv[2:] if not Path(name).is_file()]:
    sys.exit(f"expected files, got {', '.join(missing)}")
if len(sys.argv) < 3 or not sys.argv[1].endswith(".png"):
    sys.exit("expected FIGURE.png ARCHIVE.tar.xz …")
main(*sys.argv[1:])
