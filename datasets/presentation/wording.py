"""Numbers as people read them."""

import math

DASH = "–"
THESE_POLICIES = "these policies 95 %"  # in other scenes
WITH_TRAINING = "with training 95 %"  # trained again, from other seeds, too


def yes_no(answer: bool | None) -> str:
    """Return an answer, or a dash."""
    return {None: DASH, True: "yes", False: "no"}[answer]


def number(value: float | None) -> str:
    """Return a number with three digits that count, or a dash."""
    if value is None or not math.isfinite(value):
        return DASH
    if value == 0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if size >= 5 or size < -4:
        return f"{value:.1e}".replace("-", "−")
    return f"{value:.{max(0, 2 - size)}f}".replace("-", "−")


def signed(value: float) -> str:
    """Return a number with its sign."""
    return f"+{number(value)}" if value > 0 else number(value)


def span(interval: tuple[float, float] | None) -> str:
    """Return an interval, or a dash."""
    return DASH if interval is None else f"{number(interval[0])} to {number(interval[1])}"


def percent(share: float | None) -> str:
    """Return a share in percent."""
    return DASH if share is None else f"{100 * share:.0f} %"


def percent_span(interval: tuple[float, float] | None) -> str:
    """Return an interval of a share in percent."""
    return DASH if interval is None else f"{100 * interval[0]:.0f} to {100 * interval[1]:.0f} %"


def points(difference: float | None) -> str:
    """Return a difference of shares in percentage points, or a dash."""
    return DASH if difference is None else f"{100 * difference:+.0f}".replace("-", "−")


def points_span(interval: tuple[float, float] | None) -> str:
    """Return an interval of a difference of shares in percentage points."""
    return DASH if interval is None else f"{points(interval[0])} to {points(interval[1])}"


def p_value(p: float) -> str:
    """Return a p-value with its sign of comparison, never rounded up to 0.05."""
    said = "p < 0.001" if p < 0.001 else f"p = {p:.2g}"
    return "p < 0.05" if p < 0.05 and said == "p = 0.05" else said


def p_alone(p: float | None) -> str:
    """Return a p-value for a column whose heading says p; a dash for none."""
    return DASH if p is None else p_value(p).removeprefix("p = ").removeprefix("p ")


def duration(seconds: float) -> str:
    """Return a time in the unit that suits it."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.1f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
