"""The contrasts of a 2 × 2, and what they can detect: known before anything is recorded."""

import numpy as np

from handrail.datasets.statistics.contrast import reach
from handrail.policies.study.design import CONTRASTS, Factors, StudyDesign

_WORST = 0.25  # variance of a rollout's success: of one that succeeds in half of all cases
_SIGNS = {"input": (1, 1, -1, -1), "controller": (1, -1, 1, -1), "interaction": (2, -2, -2, 2)}


def weights(factors: Factors, contrast: str) -> dict[str, float]:
    """Return the weight of each mode's success in a contrast.

    `input`: hand − joint, mean over both controllers. `controller`: MPC − none, mean over both inputs.
    `interaction`: (MPC − none with the hand) − (MPC − none with the joints).
    """
    return {mode: sign / 2.0 for mode, sign in zip(factors.modes, _SIGNS[contrast], strict=True)}


def detectable(design: StudyDesign, contrast: str, tasks: int = 0, tests: int = 0) -> float:
    """Return the difference that a contrast detects in 80 % of such studies.

    (t_{1 − α/2m} + t_{0.8}) √(Σ w² (σ² + ¼ / R) / (T n)): m tests, n draws, T tasks, R rollouts a policy, σ
    the standard deviation that the design expects of a policy's success from draw to draw.

    Args:
        design: Of the study; it has factors or rounds, and two draws or more.
        contrast: Which; any one of two ways.
        tasks: T; 0 for all of the study.
        tests: m; 0 for as many as are declared, 1 where nothing is.
    """
    factors = design.factors
    asked = factors or design.rounds
    assert asked is not None
    squares = sum(weight**2 for weight in weights(factors, contrast).values()) if factors else 2.0
    variance = (asked.sd**2 + _WORST / design.rollouts) * squares
    error = float(np.sqrt(variance / (design.draws * (tasks or len(design.tasks)))))
    return reach(tests or max(1, len(asked.primary)), design.draws - 1) * error


def plan(design: StudyDesign) -> str:
    """Return in words what is declared and what it can detect."""
    asked, rounds = design.factors or design.rounds, design.rounds
    if not asked or not asked.primary:
        return "Nothing is declared: whatever comes out is exploratory."
    names = tuple(rounds.declared) if rounds else design.factors.primary if design.factors else ()
    declared = f"Declared: {'; '.join(names)}, over {', '.join(design.tasks)} together."
    if design.draws < 2:
        return f"{declared} One draw tests nothing."
    found = ", ".join(f"{each} {100 * detectable(design, each):.0f}" for each in names)
    alone = names[:1] if rounds else CONTRASTS
    single = ", ".join(f"{each} {100 * detectable(design, each, 1, 1):.0f}" for each in alone)
    return (
        f"{declared} {design.draws} draws of {design.rollouts} rollouts detect in 80 % of such studies, if a"
        f" policy's success varies by {100 * asked.sd:g} points from draw to draw, by Student's t after"
        f" Holm: {found} points; one contrast of one task by itself, which is exploratory: {single}."
    )
