"""What a study says in words: an answer of a few sentences, and how to read the rest."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from handrail.datasets.presentation.wording import p_value, percent, points, points_span
from handrail.policies.imitation.training.plateau import Plateau
from handrail.policies.study.design.design import StudyDesign
from handrail.policies.study.design.designs import designs
from handrail.policies.study.design.power import plan
from handrail.policies.study.report.contrasts import DECLARED, SYSTEM, WORDS, Contrast
from handrail.policies.study.report.results import Results

_LEVELS = (
    ("with the hand", "with the joints"),
    ("with the MPC", "without it"),
)  # of what is steered, and of the controller
_NAMES = {"act": "ACT", "diffusion": "Diffusion"}


def answer(found: Sequence[Contrast], results: Results) -> list[str]:
    """Return the answer, a sentence each: the interaction first, as means over what differs mislead."""
    design = results.progress.design
    declared = {each.name: each for each in found if each.kind == DECLARED}
    if not declared:
        return [_undeclared(design)]
    effects = {name: _effect(declared.get(words), name, results) for name, words in WORDS.items()}
    sentences = [effects["interaction"], _simple(found, results), effects["controller"], effects["input"]]
    sentences += [_clean(found, results), _limits(list(declared.values()), results)]
    return [_begun(each) for each in sentences if each]


def _undeclared(design: StudyDesign) -> str:
    if design.factors and design.factors.primary:
        return "No draw has all cells of the 2 × 2 on all tasks yet: nothing can be said."
    return "No contrast was declared before the run: what is shown explores, and nothing is tested." + (
        " With one draw it does not say how much another recording would differ." * (design.draws < 2)
    )


def _effect(contrast: Contrast | None, name: str, results: Results) -> str:
    """Return what a declared contrast says."""
    factors = results.progress.design.factors
    if contrast is None or factors is None:
        return ""
    estimate, size = contrast.estimate, f"{points(contrast.estimate.value)} points"
    if estimate.interval is None:
        return f"{_subject(contrast, name)}: one draw tests nothing"
    span = f"95 % {points_span(estimate.interval)}"
    if contrast.p_adjusted is None:
        return f"{_subject(contrast, name)}: {size} so far ({span}), not tested before all draws are done"
    rest = f"{span}, {p_value(contrast.p_adjusted)} after Holm"
    if contrast.detected:
        return f"{_subject(contrast, name)}: a difference of {size} ({rest})"
    seen = 100 * (estimate.detectable(len(factors.primary)) or 0.0)
    unseen = f"one below about {seen:.0f} points would often go unseen here"
    return f"{_subject(contrast, name)}: no difference detected ({size}, {rest}; {unseen})"


def _subject(contrast: Contrast, name: str) -> str:
    one, other = map(percent, contrast.sides)
    return {
        "controller": f"policies that learnt from demonstrations with the MPC succeeded in {one}, without in"
        f" {other}",
        "input": f"with the hand steered they succeeded in {one}, with the joints in {other}",
        "interaction": "what the MPC adds with the hand, less what it adds with the joints",
    }[name]


def _simple(found: Sequence[Contrast], results: Results) -> str:
    """Return each factor at each level of the other: where these differ, a mean over both misleads."""
    factors, tasks = results.progress.design.factors, tuple(results.progress.design.tasks)
    assert factors is not None
    named = zip(factors.pairs, (*_LEVELS[0], *_LEVELS[1]), strict=False)
    at = {f"{one} − {other}": words for (one, other), words in named}
    told = {
        at[each.name]: f"{points(each.estimate.value)} {at[each.name]} (95 % {points_span(interval)})"
        for each in found
        if (each.name in at, each.tasks, each.measure) == (True, tasks, "success")
        and (interval := each.estimate.interval)
    }
    if len(told) < len(at):
        return ""
    adds, steered = (" and ".join(told[each] for each in some) for some in _LEVELS)
    return f"explored, not tested: the MPC adds {adds}; the hand less the joints is {steered}"


def _clean(found: Sequence[Contrast], results: Results) -> str:
    """Return the factors where a success counts only if nothing was touched."""
    tasks, names = tuple(results.progress.design.tasks), {words: name for name, words in WORDS.items()}
    told = [
        f"{names[each.name]} {points(each.estimate.value)} (95 % {points_span(interval)})"
        for each in found
        if (each.name in names, each.tasks, each.measure) == (True, tasks, "clean")
        and (interval := each.estimate.interval)
    ]
    return f"explored, where a success counts only without any contact: {', '.join(told)}" if told else ""


def _limits(declared: Sequence[Contrast], results: Results) -> str:
    design, done = results.progress.design, min(each.estimate.replicates for each in declared)
    partly = (
        f"{done} of {design.draws} draws so far, " if results.progress.missing else f"{design.draws} draws, "
    )
    minutes = ", ".join(f"{task.minutes:g} min of {name}" for name, task in design.tasks.items())
    learner = _NAMES.get(design.policy, design.policy)
    seen = f"see {len(design.pictures.cameras)} cameras" if design.pictures else "see where things are"
    return (
        f"this was measured for {partly}scripted operators and one simulated robot, for {learner} policies"
        f" that {seen} and write joint velocities unprotected, and for {minutes} of operator time in each"
        " mode; it says nothing of people, of other learners, or of a policy that the MPC completes"
    )


def _begun(sentence: str) -> str:
    return f"{sentence[:1].upper()}{sentence[1:]}."


def how(results: Results, found: Sequence[Contrast]) -> str:
    """Return the paragraph: what was drawn, trained and tested."""
    return " ".join(_how(results.progress.design, results, found))


def _how(design: StudyDesign, results: Results, found: Sequence[Contrast]) -> Iterator[str]:
    yield (
        f"A draw is a fresh recording (other scenes, {design.persons} other scripted persons), one training"
        f" seed and {design.rollouts} beginnings of its own; it is the same for all modes, so draws are"
        " pairs. Every mode got the same operator time, failed attempts included: that is not the same number"
        " of demonstrations. The metrics are of all that was recorded, failures included."
    )
    if design.flat:
        yield (
            f"Each policy was trained until its loss on held-out episodes ({percent(design.flat.held_out)}, 5"
            f" at least) fell no longer: the best of {design.flat.patience} measurements, one every"
            f" {design.flat.every} updates, not {percent(design.flat.improvement)} below the best before;"
            " then the learning rate fell to zero over a last fifth of the updates. The last checkpoint"
            " counts. A loss that falls no longer does not show that success would rise no longer."
        )
    else:
        yield "Every policy got the same number of updates; whether its loss was flat by then is not known."
    yield (
        "Policies write joint velocities, which go to the robot unprotected. “Intent” is another thing: the"
        " policy writes the operator's command, and the MPC completes it and keeps it safe when the policy"
        " drives, too."
    )
    if design.draws > 1:
        yield (
            "Intervals are 95 %, Student's t over draws, where a draw varies at least as its rollouts do."
            " Contrasts are taken within each draw; several tasks count alike."
        )
    else:
        yield (
            "There is one draw: intervals (Wilson) are of these very policies, and say nothing of another"
            " recording."
        )
    declared = [each for each in found if each.kind == DECLARED]
    if declared:
        yield (
            f"Only the {len(declared)} declared contrasts are tested, p after Holm over these. All others"
            " explore. No interval is adjusted: with so many contrasts some leave out zero by chance."
        )
    if any(each.kind == SYSTEM for each in found):
        yield (
            "A system claim compares a policy and a controller with a policy alone. The other side is the"
            " best of the unprotected ones in this very measure, chosen afterwards, which is in its favour."
            " It does not tell whether the intent or the MPC does it."
        )
    yield plan(design)


def cautions(results: Results) -> list[str]:
    """Return what stands in the way of reading the results as they are meant."""
    return list(_cautions(results))


def _cautions(results: Results) -> Iterator[str]:
    progress = results.progress
    if progress.words:
        yield f"{progress.words}."
    seen = designs(progress.layout)
    if len({each["digest"] for each in seen}) > 1 or (seen and seen[-1]["digest"] != progress.design.digest):
        told = ", ".join(f"{each['digest']} from {each['since']}" for each in seen)
        yield f"The design was changed after the study began ({told}); this is {progress.design.digest}."
    again = [
        job.cell.name for job in progress.jobs if "digest_before" in progress.note(job).get("result", {})
    ]
    if again:
        yield f"Recorded again, and the rows were others than before: {', '.join(again)}."
    flat = progress.design.flat
    capped = [
        condition.label if noise == 1.0 else f"{condition.label} with noise {noise:g}"
        for (noise, *_), condition in results.conditions.items()
        if flat and any(_capped(each, progress.design, condition.task) for each in results.trained(condition))
    ]
    if capped:
        yield (
            f"Some policies of {', '.join(dict.fromkeys(capped))} ended with the most updates that there"
            " might be, before their loss was flat."
        )


def _capped(result: Mapping[str, Any], design: StudyDesign, task: str) -> bool:
    """Return whether a training ended before its loss was flat."""
    flat = design.flat
    losses = {int(step): loss for step, loss in result.get("validation", {}).items()}
    assert flat is not None
    return Plateau(losses, flat.patience, flat.improvement, design.tasks[task].steps, 0).flat is None
