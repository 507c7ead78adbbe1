"""What a study says in words: a headline, cautions, how to read the rest; the numbers are in the tables."""

from collections.abc import Mapping, Sequence
from typing import Any

from handrail.datasets.presentation.wording import points, points_span
from handrail.policies.imitation.training.plateau import Plateau
from handrail.policies.study.design.design import StudyDesign
from handrail.policies.study.design.designs import designs
from handrail.policies.study.design.power import plan
from handrail.policies.study.report.contrasts import DECLARED, WORDS, Contrast
from handrail.policies.study.report.results import Results

_UNDECLARED = "No contrast was declared before the run: what is shown explores, and nothing is tested."
_TOO_EARLY = "No draw has all cells of the 2 × 2 on all tasks yet: nothing can be said."
_LIMITS = (
    "Measured with scripted operators, one simulated robot and one learner: it says nothing of people or"
    " of other learners."
)
_ONE_DRAW = "One draw does not say how much another recording would differ."
_MISSING = "{} of {} jobs are not done yet: study.json names them."
_CHANGED = "The design was changed after the study began. Digests, in order: {}; this report is of {}."
_AGAIN = "Recorded again, and the rows were others than before: {}."
_CAPPED = "Policies that ended with the most updates that there might be, before their loss was flat: {}."
_HOW = (
    "A draw is a fresh recording (other scenes, other scripted persons), one training seed and beginnings"
    " of its own; it is the same for all modes, so draws are pairs. Every mode got the same operator time,"
    " failed attempts included: that is not the same number of demonstrations. The metrics are of all that"
    " was recorded, failures included. With [flat] in the design each policy was trained until its loss on"
    " held-out episodes fell no longer, which does not show that success would rise no longer; without it"
    " every policy got the same number of updates, and whether its loss was flat by then is not known. The"
    " last checkpoint counts. Policies write joint velocities, which go to the robot unprotected. “Intent”"
    " is another thing: the policy writes the operator's command, and the MPC completes it and keeps it"
    " safe when the policy drives, too. Intervals are 95 %: Student's t over draws, where a draw varies at"
    " least as its rollouts do; with one draw Wilson's, of these very policies. Contrasts are taken within"
    " each draw; several tasks count alike. Only declared contrasts are tested, p after Holm over these."
    " All others explore. No interval is adjusted: with so many contrasts some leave out zero by chance. A"
    " system claim compares a policy and a controller with a policy alone, the best of the unprotected ones"
    " in this very measure, chosen afterwards, which is in its favour. It does not tell whether the intent"
    " or the MPC does it."
)


def answer(found: Sequence[Contrast], design: StudyDesign) -> list[str]:
    """Return the headline, a sentence each: the interaction first, as means over what differs mislead."""
    declared = {each.name: each for each in found if each.kind == DECLARED}
    if declared:
        return [_said(declared[name]) for name in reversed(WORDS.values()) if name in declared]
    return [_TOO_EARLY if design.factors and design.factors.primary else _UNDECLARED]


def _said(each: Contrast) -> str:
    name, interval = f"{each.name[:1].upper()}{each.name[1:]}", each.estimate.interval
    if interval is None:
        return f"{name}: {points(each.estimate.value)} points; one draw tests nothing."
    seen = f"{'a' if each.detected else 'no'} difference detected"
    verdict = "not tested before all draws are done" if each.p_adjusted is None else seen
    return f"{name}: {points(each.estimate.value)} points (95 % {points_span(interval)}), {verdict}."


def how(design: StudyDesign) -> str:
    """Return the paragraph: what was drawn, trained and tested, and what that can detect."""
    return f"{_HOW} {plan(design)}"


def cautions(results: Results) -> list[str]:
    """Return what stands in the way of reading the results as they are meant."""
    progress, design = results.progress, results.progress.design
    seen = [each["digest"] for each in designs(progress.layout)]
    notes = {job.cell.name: progress.note(job) for job in progress.jobs if job.policy is None}
    again = [name for name, note in notes.items() if "digest_before" in note.get("result", {})]
    capped = sum(
        _capped(each, design, condition.task)
        for condition in results.conditions.values()
        if not condition.treatment
        for each in results.trained(condition)
    )
    known = {
        _LIMITS: True,
        _ONE_DRAW: design.draws < 2,
        _MISSING.format(len(progress.missing), len(progress.jobs)): bool(progress.missing),
        _CHANGED.format(", ".join(seen), design.digest): bool({*seen} - {design.digest}),
        _AGAIN.format(", ".join(again)): bool(again),
        _CAPPED.format(capped): capped > 0,
    }
    return [text for text, holds in known.items() if holds]


def _capped(result: Mapping[str, Any], design: StudyDesign, task: str) -> bool:
    """Return whether a training ended before its loss was flat."""
    flat = design.flat
    if flat is None:
        return False
    losses = {int(step): loss for step, loss in result.get("validation", {}).items()}
    return Plateau(losses, flat.patience, flat.improvement, design.tasks[task].steps, 0).flat is None
