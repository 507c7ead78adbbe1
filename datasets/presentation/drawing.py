"""Shared by all figures: colours that everybody can tell apart, quiet axes, and SVG inside the page."""

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from handrail.datasets.printable import printable

# Okabe–Ito
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#5b4b8a", "#7f7f7f")
INK, GREY, FAINT = "#1d2733", "#8a94a0", "#e3e7ec"


@dataclass(frozen=True)
class Panel:
    """A figure of one pair of axes. Its title stands beside it in the page, which breaks lines."""

    title: str  # One line
    figure: Any  # Of matplotlib, without a title
    note: str = ""  # How to read it


def short(label: str, most: int) -> str:
    """Return a label that fits beside axes and is no formula: the middle of a long one is left out."""
    label = printable(label)
    if len(label) > most:
        head = (most - 1) // 2
        label = f"{label[:head]}…{label[len(label) - (most - 1 - head) :]}"
    return label.replace("$", "\\$")


def new_figure(width: float, height: float) -> Any:
    """Return an empty figure [inch]."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def svg(figure: Any) -> str:
    """Return a figure as an address that holds all of it; the same figure gives the same text."""
    import matplotlib

    stream = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "handrail"}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    return address(stream.getvalue(), "image/svg+xml")


def png(figure: Any) -> bytes:
    """Return a figure as a file for a Markdown page, of 256 colours: a third of the bytes."""
    from PIL import Image

    stream, small = io.BytesIO(), io.BytesIO()
    figure.savefig(stream, format="png", dpi=110, metadata={"Software": None})
    whole = Image.open(stream).convert("RGB")
    few = whole.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(small, "png", optimize=True)
    return small.getvalue()


def address(data: bytes, kind: str) -> str:
    """Return an address that holds all of a file, whose MIME type is `kind`."""
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


def rows(axes: Any, labels: Sequence[str], most: int = 60) -> None:
    """Give axes a row for each label, from above, each with so many letters at most."""
    names = [short(label, most) for label in labels]
    axes.set(ylim=(len(names) - 0.4, -0.6), yticks=range(len(names)), yticklabels=names)
    tidy(axes, "x")


def tidy(axes: Any, grid: str = "both") -> None:
    """Make axes quiet; `grid` is x, y, both or ""."""
    if grid:
        axes.grid(axis=grid, color=FAINT, lw=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(GREY)
    axes.tick_params(colors=INK, labelsize=8, length=0, pad=6)
    axes.title.set(size=9.5, color=INK, weight="bold")
    for label in (axes.xaxis.label, axes.yaxis.label):
        label.set(size=8.5, color=INK)
