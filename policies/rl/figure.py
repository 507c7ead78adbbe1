"""The figure of a training: what the evaluations said, over steps."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from handrail.datasets.storage.atomic import write_whole

PUBLISHED = {"success": 0.97, "arm_effort": 62.6, "jerkiness": 0.681}  # of the paper's own baseline, Table I
_NAMES = {
    "success": "share of goals reached",
    "arm_effort": "arm effort Σ‖q̇‖² [rad²/s²]",
    "jerkiness": "jerkiness [m/s², rad/s²]",
}


def save_curve(curve: Sequence[dict[str, float]], path: Path) -> None:
    """Write the curves of success, arm effort and jerkiness, with the published figures, as a picture.

    Args:
        curve: one row an evaluation.
        path: of the picture.
    """
    figure = Figure(figsize=(11, 3.4), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes: Any = figure.subplots(1, len(PUBLISHED))
    for axis, (name, published) in zip(axes, PUBLISHED.items(), strict=True):
        axis.plot([row["steps"] / 1000 for row in curve], [row[name] for row in curve], color="#2a6fbb")
        axis.axhline(published, color="#666666", linestyle="--", label="published")
        axis.set(xlabel="thousand steps", title=_NAMES[name], ylim=(0.0, None))
    axes[0].legend(loc="lower right")
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    write_whole(path, stream.getvalue())
