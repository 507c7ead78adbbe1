"""Trials as tables, one for each task with a line for each mode; and as part of a page."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from handrail.datasets.presentation.markdown import markdown_table, write_part
from handrail.datasets.presentation.table import Table
from handrail.datasets.statistics.paired import wilson
from handrail.scripts.bench.command_line import command_line
from handrail.scripts.bench.operators.config import TrialsConfig
from handrail.scripts.bench.operators.file import Trial

HEADINGS = (
    *("mode", "success", "95 %", "failures", "time of successes [s]", "episodes with contact"),
    *("smallest distance [m]", "braked updates", "switches", "time in switches"),
)
_WORDS = (
    "Time: mean ± SD. 95 %: Wilson. Contacts are forbidden ones. Switches: mean an episode; time in "
    "switches: share of all time in which the hands are away from the input to change to other channels."
)


def trials_table(trials: Sequence[Trial], modes: Sequence[str], task: str) -> Table:
    """Return a task's table: a line for each mode that has trials."""
    groups = [[each for each in trials if (each.task, each.mode) == (task, mode)] for mode in modes]
    return Table(HEADINGS, [_line(group) for group in groups if group], task)


def write_page(trials: Sequence[Trial], config: TrialsConfig) -> None:
    """Put a table a task between the trials' marks of the page, made if need be; other text stays."""
    parts = [f"`{command_line('operators', config)}` wrote this. {_WORDS}"]
    parts += [markdown_table(trials_table(trials, config.mode_names, task)) for task in config.task_names]
    write_part(Path(config.page).expanduser(), "Scripted operators", "trials", "\n\n".join(parts))


def _line(group: Sequence[Trial]) -> list[str]:
    successes = [trial.seconds for trial in group if trial.success]
    low, high = wilson(len(successes), len(group))
    failures = Counter(trial.failure_reason for trial in group if not trial.success)
    brakes, frames = sum(trial.brakes for trial in group), sum(trial.frames for trial in group)
    seconds = sum(trial.seconds for trial in group)
    return [
        group[0].mode,
        f"{len(successes)} of {len(group)}",
        f"{100 * low:.0f} to {100 * high:.0f} %",
        ", ".join(f"{why} ({count})" for why, count in failures.most_common()) or "–",
        f"{np.mean(successes):.1f} ± {np.std(successes):.1f}" if successes else "–",
        str(sum(trial.contacts > 0 for trial in group)),
        f"{min(trial.smallest_distance for trial in group):.3f}",
        f"{brakes} of {frames}",
        f"{np.mean([trial.switches for trial in group]):.1f}",
        f"{100 * sum(trial.switching for trial in group) / seconds:.1f} %",
    ]
