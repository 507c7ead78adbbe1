"""What is compared: the contrasts that were declared before the run, and all others, which only explore."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from handrail.datasets.statistics.contrast import Contrast, adjusted
from handrail.datasets.statistics.replicates import student
from handrail.policies.study.design import CONTRASTS, StudyDesign
from handrail.policies.study.power import weights
from handrail.policies.study.results import MEASURES, Results, StudyCondition

DECLARED, EXPLORATORY, SYSTEM = "declared", "exploratory", "system"
WORDS = {
    "input": "input: hand − joints",
    "controller": "controller: MPC − none",
    "interaction": "interaction: what the MPC adds with the hand − with the joints",
}


def contrasts(results: Results) -> list[Contrast]:
    """Return all contrasts for which there is something: the declared ones first, p adjusted over these.

    Nothing is tested before all draws are there: who looks in between and stops where it suits finds more.
    """
    design = results.progress.design
    names = design.factors.primary if design.factors else ()
    declared = [_factor(results, design, name, tuple(design.tasks), DECLARED) for name in names]
    whole = [each for each in declared if each and each.counts == (design.draws,) != (1,)]
    tested = {each.label: each for each in adjusted(whole)}
    found = [replace(tested.get(each.label, each), tests=len(names)) for each in declared if each]
    return found + [each for each in _exploratory(results, design) if each]


def _exploratory(results: Results, design: StudyDesign) -> Iterator[Contrast | None]:
    tasks = tuple(design.tasks)
    scopes = [*([tasks] if len(tasks) > 1 else []), *((task,) for task in tasks)]
    factors = design.factors
    for scope in scopes:
        for name in CONTRASTS if factors else ():
            if scope != tasks or name not in factors.primary:  # pyright: ignore[reportOptionalMemberAccess]
                yield _factor(results, design, name, scope, EXPLORATORY)
        if factors:
            for one, other in factors.pairs:
                yield _pair(results, one, other, scope)
                yield _pair(results, one, other, scope, "", "clean")
                yield _pair(results, one, other, scope, " same number")
        for mode in () if factors else design.modes:
            if mode != design.baseline:
                yield _pair(results, mode, design.baseline, scope)
        yield from _systems(results, design, scope)
        for name in CONTRASTS if factors else ():
            yield _factor(results, design, name, scope, EXPLORATORY, " same number")
            yield _factor(results, design, name, scope, EXPLORATORY, "", "contact")
            yield _factor(results, design, name, scope, EXPLORATORY, "", "clean")


def _factor(
    results: Results,
    design: StudyDesign,
    name: str,
    tasks: tuple[str, ...],
    kind: str,
    ending: str = "",
    measure: str = "success",
) -> Contrast | None:
    assert design.factors is not None
    parts = {f"{mode}{ending}": weight for mode, weight in weights(design.factors, name).items()}
    return _contrast(results, f"{WORDS[name]}{_bracketed(ending)}", kind, tasks, parts, measure)


def _pair(
    results: Results,
    one: str,
    other: str,
    tasks: tuple[str, ...],
    ending: str = "",
    measure: str = "success",
) -> Contrast | None:
    parts = {f"{one}{ending}": 1.0, f"{other}{ending}": -1.0}
    return _contrast(results, f"{one} − {other}{_bracketed(ending)}", EXPLORATORY, tasks, parts, measure)


def _bracketed(ending: str) -> str:
    return f" ({ending.strip()})" if ending else ""


def _systems(results: Results, design: StudyDesign, tasks: tuple[str, ...]) -> Iterator[Contrast | None]:
    """Yield intents completed by the MPC against what did best of joint velocities in the same measure."""
    for mode in design.beside.intents if design.beside else ():
        intent = [results.find(task, f"{mode} intent") for task in tasks]
        if not all(intent):
            continue
        draws = set.intersection(*(set(each.draws) for each in intent if each))
        for measure, sign in (("success", 1.0), ("contact", -1.0)):
            rivals = [[results.find(task, label) for task in tasks] for label in design.modes]
            means = {
                label: sign * mean
                for label, each in zip(design.modes, rivals, strict=True)
                if (mean := _mean(each, draws, measure)) is not None
            }
            if means:
                best = max(means, key=means.__getitem__)
                parts = {f"{mode} intent": 1.0, best: -1.0}
                title = (
                    f"{mode} intent + MPC − {best}, of the unprotected policies of joint velocities the best"
                )
                yield _contrast(results, title, SYSTEM, tasks, parts, measure)


def _mean(conditions: Sequence[StudyCondition | None], draws: set[int], measure: str) -> float | None:
    """Return the mean of a measure over conditions and some draws; None where one is missing."""
    known = [each for each in conditions if each and draws <= each.draws.keys()]
    if len(known) < len(conditions):
        return None
    return float(np.mean([each.share(draw, measure) for each in known for draw in draws]))


def _contrast(
    results: Results,
    name: str,
    kind: str,
    tasks: tuple[str, ...],
    parts: Mapping[str, float],
    measure: str = "success",
) -> Contrast | None:
    """Return a contrast over the draws that all of its conditions have; None without any."""
    found = [(results.find(task, label), weight) for task in tasks for label, weight in parts.items()]
    conditions = [(each, weight / len(tasks)) for each, weight in found if each]
    if len(conditions) < len(found):
        return None
    draws = sorted(set.intersection(*(set(each.draws) for each, _ in conditions)))
    if not draws:
        return None
    values = [sum(weight * each.share(draw, measure) for each, weight in conditions) for draw in draws]
    least = sum(weight**2 * each.least(measure) for each, weight in conditions)
    sides = _side(conditions, draws, measure, 1.0), _side(conditions, draws, measure, -1.0)
    return Contrast(
        measure=MEASURES[measure],
        label=name,
        scope=", ".join(tasks),
        family=kind,
        sides=sides,
        **vars(student(values, least)),
    )


def _side(
    conditions: Sequence[tuple[StudyCondition, float]], draws: Sequence[int], measure: str, sign: float
) -> float:
    """Return the mean over the conditions whose weights have a sign."""
    side = [(each, abs(weight)) for each, weight in conditions if weight * sign > 0.0]
    total = sum(weight * each.share(draw, measure) for each, weight in side for draw in draws)
    return total / (len(draws) * sum(weight for _, weight in side))
