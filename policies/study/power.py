"""The contrasts of a 2 × 2, and what they can detect: known before anything is recorded."""

from functools import partial

import numpy as np

from handrail.datasets.statistics.contrast import reach
from handrail.datasets.statistics.replicates import equivalence_power
from handrail.policies.study.design import CONTRASTS, DeclaredPair, Factors, StudyDesign

_WORST = 0.25  # variance of a rollout's success: of one that succeeds in half of all cases
WORDS = {
    "input": "input: hand − joints",
    "controller": "controller: MPC − none",
    "interaction": "interaction: what the MPC adds with the hand − with the joints",
}
_SIGNS = {"input": (1, 1, -1, -1), "controller": (1, -1, 1, -1), "interaction": (2, -2, -2, 2)}


def weights(factors: Factors, contrast: str) -> dict[str, float]:
    """Return the weight of each mode's success in a contrast.

    `input`: hand − joint, mean over both controllers. `controller`: MPC − none, mean over both inputs.
    `interaction`: (MPC − none with the hand) − (MPC − none with the joints).
    """
    return {mode: sign / 2.0 for mode, sign in zip(factors.modes, _SIGNS[contrast], strict=True)}


def standard_error(design: StudyDesign, sd: float, total: float, tasks: int = 0) -> float:
    """Return √(Σ w² (σ² + ¼ / R) / (T n)) of a contrast: n draws, T tasks, R rollouts a policy.

    Args:
        design: of the study.
        sd: σ, expected of a policy's success from draw to draw.
        total: Σ w² over the modes.
        tasks: T; 0 for all of the study.
    """
    variance = (sd**2 + _WORST / design.rollouts) * total
    return float(np.sqrt(variance / (design.draws * (tasks or len(design.tasks)))))


def detectable(design: StudyDesign, contrast: str, tasks: int = 0, tests: int = 0) -> float:
    """Return the difference that a contrast of the factors detects in 80 % of such studies.

    (t_{1 − α/2m} + t_{0.8}) s: m tests, s the `standard_error`.

    Args:
        design: of the study; it has factors, and two draws or more.
        contrast: which.
        tasks: of which it is; 0 for all of the study.
        tests: m; 0 for as many as are declared, 1 where nothing is.
    """
    factors = design.factors
    assert factors is not None
    total = sum(weight**2 for weight in weights(factors, contrast).values())
    error = standard_error(design, factors.sd, total, tasks)
    return reach(tests or max(1, len(factors.primary)), design.draws - 1) * error


def planned(design: StudyDesign) -> dict[str, float]:
    """Return the difference that each declared contrast is to detect, by its words; of two draws or more."""
    found = (
        {WORDS[name]: detectable(design, name) for name in design.factors.primary} if design.factors else {}
    )
    least = reach(len(design.pairs), design.draws - 1)
    return found | {each.label: least * standard_error(design, each.sd, 2.0) for each in design.pairs}


def plan(design: StudyDesign) -> str:
    """Return in words what is declared and what it can detect."""
    names = [each.label for each in design.pairs] or (design.factors.primary if design.factors else ())
    if not names:
        return "Nothing is declared: whatever comes out is exploratory."
    declared = f"Declared: {', '.join(names)}, over {', '.join(design.tasks)} together."
    if design.draws < 2:
        return f"{declared} One draw tests nothing."
    found = ", ".join(
        f"{name} {100 * points:.0f}" for name, points in zip(names, planned(design).values(), strict=True)
    )
    sds = [each.sd for each in design.pairs] or [design.factors.sd if design.factors else 0.0]
    points = " or ".join(f"{100 * sd:g}" for sd in sorted({*sds}))
    told = (
        f"{declared} {design.draws} draws of {design.rollouts} rollouts detect in 80 % of such studies, if a"
        f" policy's success varies by {points} points from draw to draw, by Student's t after Holm:"
        f" {found} points"
    )
    if design.pairs:
        return f"{told}. {' '.join(map(partial(_equivalence, design), design.pairs))}".strip()
    single = ", ".join(f"{each} {100 * detectable(design, each, 1, 1):.0f}" for each in CONTRASTS)
    return f"{told}; one contrast of one task by itself, which is exploratory: {single}."


def _equivalence(design: StudyDesign, pair: DeclaredPair) -> str:
    if not pair.margin:
        return ""
    power = equivalence_power(pair.margin, standard_error(design, pair.sd, 2.0), design.draws - 1)
    return (
        f"Of {pair.label} equivalence is declared too: nearer than {100 * pair.margin:g} points, two"
        f" one-sided tests at 5 %; found by {100 * power:.0f} % of such studies where there is no difference."
    )
