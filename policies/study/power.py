"""The power of a study's declared contrasts: known before anything is recorded."""

import numpy as np

from handrail.datasets.statistics.contrast import reach
from handrail.datasets.statistics.replicates import equivalence_power
from handrail.policies.study.declared import Declared, declared
from handrail.policies.study.design import StudyDesign

_WORST = 0.25  # variance of a rollout's success: of one that succeeds in half of all cases


def standard_error(design: StudyDesign, each: Declared, alone: bool = False) -> float:
    """Return √(Σ w² (σ² + ¼ / R) / (T n)) of a contrast: n draws, T tasks, R rollouts a policy.

    Args:
        design: of the study.
        each: the contrast, with its w and σ.
        alone: whether it is of one task instead of all.
    """
    total = sum(weight**2 for weight in each.parts.values())
    variance = (each.sd**2 + _WORST / design.rollouts) * total
    return float(np.sqrt(variance / (design.draws * (1 if alone else len(design.tasks)))))


def detectable(design: StudyDesign, each: Declared, alone: bool = False) -> float:
    """Return the difference that a contrast detects in 80 % of such studies.

    (t_{1 − α/2m} + t_{0.8}) s: m tests, s the `standard_error`.

    Args:
        design: of the study; it has two draws or more.
        each: the contrast.
        alone: whether it is of one task and the only test, instead of all tasks and all that is declared.
    """
    tests = 1 if alone else len(declared(design))
    return reach(tests, design.draws - 1) * standard_error(design, each, alone)


def plan(design: StudyDesign) -> str:
    """Return in words what is declared and what it can detect."""
    asked = declared(design)
    if not asked:
        return "Nothing is declared: all results are exploratory."
    told = f"Declared: {', '.join(each.label for each in asked)}, over {', '.join(design.tasks)} together."
    if design.draws < 2:
        return f"{told} One draw tests nothing."
    whole, single = (
        ", ".join(f"{each.label} {100 * detectable(design, each, alone):.0f}" for each in asked)
        for alone in (False, True)
    )
    spread = " or ".join(f"{100 * sd:g}" for sd in sorted({each.sd for each in asked}))
    told = (
        f"{told} {design.draws} draws of {design.rollouts} rollouts detect in 80 % of such studies, if a"
        f" policy's success varies by {spread} points from draw to draw, by Student's t after"
        f" Holm: {whole} points; one contrast of one task by itself, which is exploratory: {single}."
    )
    return " ".join([told, *(_equivalence(design, each) for each in asked if each.margin)])


def _equivalence(design: StudyDesign, each: Declared) -> str:
    power = equivalence_power(each.margin, standard_error(design, each), design.draws - 1)
    return (
        f"Of {each.label} equivalence is declared too: nearer than {100 * each.margin:g} points, two"
        f" one-sided tests at 5 %; found by {100 * power:.0f} % of such studies where there is no difference."
    )
