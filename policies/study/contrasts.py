"""What is compared: the contrasts that were declared before the run, and all others, which only explore."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from handrail.datasets.statistics.contrast import Contrast, adjusted
from handrail.datasets.statistics.replicates import student
from handrail.policies.study.design import CONTRASTS, Factors, StudyDesign
from handrail.policies.study.power import WORDS, weights
from handrail.policies.study.results import MEASURES, Results, StudyCondition

DECLARED, EXPLORATORY, SYSTEM = "declared", "exploratory", "system"
Parts = Mapping[str, float]  # the weight of each policy's success


def contrasts(results: Results) -> list[Contrast]:
    """Return all contrasts for which there is something: the declared ones first, p adjusted over these.

    Nothing is tested before all draws are there: who looks in between and stops where it suits finds more.
    """
    design, tasks = results.progress.design, tuple(results.progress.design.tasks)
    factors = design.factors
    asked = [_factor(factors, name) for name in factors.primary] if factors else []
    asked += [_pair(each.one, each.other, each.ending) for each in design.pairs]
    declared = [each for one in asked if (each := _contrast(results, DECLARED, tasks, *one))]
    whole = [each for each in declared if each.counts == (design.draws,) != (1,)]
    tested = {each.label: each for each in adjusted(whole)}
    found = [replace(tested.get(each.label, each), tests=len(asked)) for each in declared]
    scopes = [*([tasks] if len(tasks) > 1 else []), *((task,) for task in tasks)]
    explored = [each for scope in scopes for each in _exploratory(results, design, scope) if each]
    return found + explored


def _exploratory(results: Results, design: StudyDesign, tasks: tuple[str, ...]) -> Iterator[Contrast | None]:
    ask, factors = partial(_contrast, results, EXPLORATORY, tasks), design.factors
    if not factors:
        rivals = [mode for mode in design.modes if mode != design.baseline]
        yield from (ask(*_pair(mode, design.baseline)) for mode in rivals)
        for each in design.pairs:
            pair = _pair(each.one, each.other, each.ending)
            if tasks != tuple(design.tasks) and (each.other, each.budget) != (design.baseline, "time"):
                yield ask(*pair)
            yield ask(*pair, "clean")
        yield from _systems(results, design, tasks)
        return
    for name in CONTRASTS:
        if tasks != tuple(design.tasks) or name not in factors.primary:
            yield ask(*_factor(factors, name))
    for pair in factors.pairs:
        yield ask(*_pair(*pair))
        yield ask(*_pair(*pair), "clean")
        yield ask(*_pair(*pair, " same number"))
    yield from _systems(results, design, tasks)
    for name in CONTRASTS:
        yield ask(*_factor(factors, name, " same number"))
        yield ask(*_factor(factors, name), "contact")
        yield ask(*_factor(factors, name), "clean")


def _factor(factors: Factors, name: str, ending: str = "") -> tuple[str, Parts]:
    parts = {f"{mode}{ending}": weight for mode, weight in weights(factors, name).items()}
    return f"{WORDS[name]}{_bracketed(ending)}", parts


def _pair(one: str, other: str, ending: str = "") -> tuple[str, Parts]:
    return f"{one} − {other}{_bracketed(ending)}", {f"{one}{ending}": 1.0, f"{other}{ending}": -1.0}


def _bracketed(ending: str) -> str:
    return f" ({ending.strip()})" if ending else ""


def _systems(results: Results, design: StudyDesign, tasks: tuple[str, ...]) -> Iterator[Contrast | None]:
    """Yield intents completed by the MPC against what did best of joint velocities in the same measure."""
    for mode in design.beside.intents if design.beside else ():
        intents = [each for task in tasks if (each := results.find(task, f"{mode} intent"))]
        if len(intents) < len(tasks):
            continue
        draws = set.intersection(*(set(each.draws) for each in intents))
        for measure, sign in (("success", 1.0), ("contact", -1.0)):
            found = {label: _mean(results, tasks, label, draws, measure) for label in design.modes}
            known = {label: sign * mean for label, mean in found.items() if mean is not None}
            if known:
                best = max(known, key=known.__getitem__)
                title = (
                    f"{mode} intent + MPC − {best}, of the unprotected policies of joint velocities the best"
                )
                parts = {f"{mode} intent": 1.0, best: -1.0}
                yield _contrast(results, SYSTEM, tasks, title, parts, measure)


def _mean(results: Results, tasks: Sequence[str], label: str, draws: set[int], measure: str) -> float | None:
    """Return the mean of a measure of a policy over tasks and some draws; None where one is missing."""
    found = [results.find(task, label) for task in tasks]
    known = [each for each in found if each and draws <= each.draws.keys()]
    if len(known) < len(found):
        return None
    return float(np.mean([each.share(draw, measure) for each in known for draw in draws]))


def _contrast(
    results: Results, kind: str, tasks: Sequence[str], label: str, parts: Parts, measure: str = "success"
) -> Contrast | None:
    """Return a contrast over the draws that all of its conditions have; None without any."""
    found = [(results.find(task, name), weight) for task in tasks for name, weight in parts.items()]
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
        label=label,
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
