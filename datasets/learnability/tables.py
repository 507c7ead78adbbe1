"""Learnability as tables: what is told, with and without what may be hidden, and when."""

from collections.abc import Iterator, Mapping

from handrail.datasets.learnability.candidates import MEANINGS
from handrail.datasets.learnability.learnability import CAVEAT, Learnability, Predictability, Score
from handrail.datasets.learnability.parts import ALL
from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.presentation.wording import DASH, number, signed, span

_GAIN = "R² with it minus R² without it, 95 %"


def learnability_words(found: Mapping[str, Learnability | str]) -> str:
    """Return what was found of each dataset, or why it does not apply, and how far to trust it."""
    known = {label: each for label, each in found.items() if isinstance(each, Learnability)}
    told = [f"{label}: {reason}" for label, reason in found.items() if isinstance(reason, str)]
    for label, each in known.items():
        space, usual = each.usual
        score = usual.parts[ALL]
        told.append(f"{label} {number(score.estimate)} (95 % {span(score.interval)}; {space}")
        told[-1] += f", {each.episodes} episodes, {each.frames} frames)"
    return (
        f"Learnability, held-out R² of the action from what a policy reads: {'; '.join(told)}. It is"
        f" described, not tested: no difference is claimed.{f' {CAVEAT}' if known else ''}"
    )


def learnability_tables(found: Mapping[str, Learnability | str]) -> list[Table]:
    """Return R² by part, with and without what may be hidden, and by phase; none where nothing applies."""
    known = {label: each for label, each in found.items() if isinstance(each, Learnability)}
    return [_hidden(known), _phases(known)] if known else []


def _hidden(found: Mapping[str, Learnability]) -> Table:
    rows = list(_spaces(found))
    names = [name for name in MEANINGS if any(name in each.gains for *_, each in rows)]
    shown = {name for each in found.values() for name in each.shown}
    headings = ("data", "action", "part", "R² from what is seen")
    headings += tuple(f"{'without' if name in shown else 'with'} {name}" for name in names)
    cells = [
        [
            label,
            space,
            part,
            _cell(each.parts[part]),
            *(_other(found[label], each, name, part) for name in names),
        ]
        for label, space, each in rows
        for part in (each.parts if space == found[label].usual[0] else (ALL,))
    ]
    meanings = "; ".join(f"{name}: {MEANINGS[name]}" for name in names)
    return Table(headings, cells, "Learnability", f"Below R²: 95 %; below the others: {_GAIN}. {meanings}.")


def _phases(found: Mapping[str, Learnability]) -> Table:
    rows = list(_spaces(found))
    phases = list(dict.fromkeys(phase for *_, each in rows for phase in each.phases))
    headings = ("data", "action", *(f"R², {phase}" for phase in phases), "two heaps")
    cells = [
        [label, space, *(_cell(each.phases.get(phase)) for phase in phases), _cell(each.two_heaps)]
        for label, space, each in rows
    ]
    caption = (
        "R² within each phase. Two heaps: share of what is left of the actions near like observations where"
        " other episodes did one of two things; 0.05 by chance."
    )
    return Table(headings, cells, "Learnability by phase", caption)


def _spaces(found: Mapping[str, Learnability]) -> Iterator[tuple[str, str, Predictability]]:
    for label, each in found.items():
        yield from ((label, space, known) for space, known in each.spaces.items())


def _cell(score: Score | None) -> Cell:
    return Cell(number(score.estimate), below=span(score.interval)) if score else Cell(DASH, "quiet")


def _other(found: Learnability, each: Predictability, name: str, part: str) -> Cell:
    """Return R² with a candidate where it is hidden, and without it where it is seen."""
    if name not in each.gains:
        return Cell(DASH, "quiet", "it never changes, or is not recorded")
    gain, known = each.gains[name][part], each.parts[part].estimate
    low, high = gain.interval
    other = known - gain.estimate if name in found.shown else known + gain.estimate
    look = "detected" if low > 0.0 else ""
    return Cell(number(other), look, _GAIN, f"{signed(low)} to {signed(high)}")
