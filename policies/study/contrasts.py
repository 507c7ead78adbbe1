"""Contrasts: those declared before the run, and all others, which only explore."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from handrail.datasets.statistics.contrast import Contrast, adjusted
from handrail.datasets.statistics.replicates import chance_of_shares, student
from handrail.policies.study.declared import Parts, declared, of_pair, of_ways
from handrail.policies.study.design import StudyDesign
from handrail.policies.study.results import MEASURES, Results, StudyCondition

DECLARED, EXPLORATORY, SYSTEM = "declared", "exploratory", "system"


def contrasts(results: Results) -> list[Contrast]:
    """Return all contrasts for which there is something: the declared ones first, p adjusted over these.

    Nothing is tested before all draws of all of them are there: a look in between that ends a study where it
    suits finds more. A contrast that is not tested has no p.
    """
    design, tasks = results.progress.design, tuple(results.progress.design.tasks)
    asked = [(each.label, each.parts) for each in declared(design)]
    first = [each for one in asked if (each := _contrast(results, DECLARED, tasks, *one))]
    complete = len(first) == len(asked) and all(each.counts == (design.draws,) != (1,) for each in first)
    found = adjusted(first) if complete else [replace(each, p=None, tests=len(asked)) for each in first]
    scopes = [*([tasks] if len(tasks) > 1 else []), *((task,) for task in tasks)]
    more = (each for scope in scopes for each in _exploratory(results, design, scope) if each)
    found += [replace(each, p=None) for each in more]
    once: dict[tuple[str, ...], Contrast] = {}
    for each in found:
        once.setdefault((each.label, each.scope, each.measure.name), each)
    return list(once.values())


def _exploratory(results: Results, design: StudyDesign, tasks: tuple[str, ...]) -> Iterator[Contrast | None]:
    """Yield all that may be of interest, what is declared among it."""
    ask = partial(_contrast, results, EXPLORATORY, tasks)
    if rounds := design.rounds:
        for number, pair in product(range(1, rounds.count + 1), rounds.pairs):
            yield ask(*of_ways(pair, number))
            if number == rounds.count:
                yield ask(*of_ways(pair, number), "clean")
        for number, way in product(range(1, rounds.count + 1), rounds.ways):
            yield ask(*of_pair(f"{way}-{number} intent", f"{design.baseline} intent"))
        return
    rivals = [mode for mode in design.modes if mode != design.baseline]
    for mode, ending in product(rivals, ("", " same number")):
        yield ask(*of_pair(mode, design.baseline, ending))
    for each in declared(design):
        yield ask(each.label, each.parts)
        yield ask(each.label, each.parts, "clean")
    yield from _systems(results, design, tasks)


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
    least = sum(weight**2 * chance_of_shares(each.runs(measure)) for each, weight in conditions)
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
