"""What a fit says: a table, sentences, and plain values for programs."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from handrail.collect.experiments.operator_fit.fit import UNLIKE, Estimate, Fit
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.wording import DASH, number, span
from handrail.datasets.statistics.resampling import FEWEST

FORMAT = "handrail.operator_fit/1"
_FEW = 10  # episodes


def fit_table(fit: Fit) -> Table:
    """Return every number, fitted and by default."""
    rows = [_row(each) for each in fit.estimates]
    return Table(("number", "fitted", "95 %", "default", "fitted / default", ""), rows)


def _row(each: Estimate) -> list[str]:
    name = f"{each.name} [{each.unit}]" if each.unit else each.name
    if each.value is None:
        return [name, "not told", DASH, number(each.default), DASH, each.reason]
    verdict = "differs from the default" if each.differs else ""
    ratio = number(each.value / each.default) if each.default else DASH
    return [name, number(each.value), span(each.interval), number(each.default), ratio, verdict]


def throughput(fit: Fit) -> tuple[float, tuple[float, float] | None] | None:
    """Return the throughput `briskness · gain / ln 2` [bit/s] and its interval; None where not told."""
    (found,) = [each for each in fit.estimates if each.name == "briskness"]
    if found.value is None:
        return None
    factor = fit.gain / float(np.log(2.0))
    interval = (factor * found.interval[0], factor * found.interval[1]) if found.interval else None
    return factor * found.value, interval


def flags(fit: Fit) -> str:
    """Return the flags with which handrail-record has this operator; "" where nothing was told."""
    told = [f"--human.{each.name} {each.value:.3g}" for each in fit.estimates if each.value is not None]
    return " ".join([*told, "--human.persons 0"]) if told else ""


def sentences(fit: Fit, left_out: Sequence[str]) -> Iterator[str]:
    """Yield what a reader has to know beside the table, the flags last."""
    held = "keys that are on or off" if fit.keys else "sticks"
    whose = f"device {fit.device!r}" if fit.device else "no device: a script steered, no person"
    yield f"{fit.episodes} episodes, {fit.seconds:.0f} s of steering; {whose}; taken for {held}."
    found = throughput(fit)
    if found:
        value, interval = found
        yield f"Throughput {number(value)} bit/s, 95 % {span(interval)}."
    if fit.episodes < FEWEST:
        yield f"Too few episodes for intervals: they need {FEWEST} or more."
    elif fit.episodes < _FEW:
        yield f"Few episodes: the numbers are rough below about {_FEW}."
    likeness = fit.likeness
    yield (
        f"Distance between the input and this operator's: {number(likeness.fitted)} standard deviations of"
        f" the operator's own spread (with the defaults {number(likeness.default)}; about 1 is alike)."
    )
    if likeness.default < likeness.fitted < UNLIKE:
        yield "The defaults are as near as the fitted numbers: nothing speaks for changing them."
    if likeness.fitted >= UNLIKE:
        worst = ", ".join(f"{name} ({value:+.1f})" for name, value in likeness.worst)
        yield f"No scripted operator steers like that. Least alike: {worst}."
    if left_out:
        yield f"Left out: {len(left_out)} episodes. {'; '.join(left_out[:3])}{' …' if left_out[3:] else ''}"
    yield (
        f"Use it: handrail-record {flags(fit)}"
        if flags(fit)
        else "Nothing was told: there is nothing to use."
    )


def as_json(fit: Fit, left_out: Sequence[str]) -> dict[str, Any]:
    """Return everything as plain values."""
    found = throughput(fit)
    estimates = {each.name: asdict(each) | {"differs": each.differs} for each in fit.estimates}
    return {
        "format": FORMAT,
        "episodes": fit.episodes,
        "seconds": fit.seconds,
        "device": fit.device,
        "on_off_keys": fit.keys,
        "estimates": estimates,
        "throughput": {"value": found[0], "interval": found[1], "unit": "bit/s"} if found else None,
        "distance": asdict(fit.likeness),
        "left_out": list(left_out),
        "human": asdict(fit.human),
        "flags": flags(fit),
        "sentences": list(sentences(fit, left_out)),
    }
