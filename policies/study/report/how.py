"""How a study's page is to be read, said of this design and these results alone."""

from collections.abc import Iterator, Sequence

from handrail.collect.operators.modes import MODES
from handrail.datasets.comparison.outcomes import OutcomeDifference, Outcomes
from handrail.datasets.presentation.wording import families
from handrail.policies.study.design.design import StudyDesign
from handrail.policies.study.report.results import TaskResults

_BUDGETS = {
    "time": "what could be demonstrated in the same operator time, failed attempts included",
    "number": "the same number of successful demonstrations (“same number”)",
}


def how(design: StudyDesign, results: Sequence[TaskResults]) -> str:
    """Return the paragraph: what was trained on what, what drives, which intervals and tests there are."""
    return " ".join([*_policies(design, results), *_intervals(results), *_tests(results)])


def _policies(design: StudyDesign, results: Sequence[TaskResults]) -> Iterator[str]:
    data = ", and others on ".join(_BUDGETS[budget] for budget in design.budgets)
    yield (
        "Policies of every mode were trained with the same settings for the same number of updates on"
        f" {data}; they were driven from the same beginnings."
    )
    mixed = [mode for mode in design.modes if _differs_twice(mode, design.baseline)]
    if mixed:
        yield (
            f"{', '.join(mixed)} against {design.baseline}: what the operator steers and the controller"
            " differ at once, so a difference does not say which of the two made it."
        )
    intents = any(
        found.condition.actions == "intent" for each in results for found in each.undisturbed.values()
    )
    yield (
        "Like for like are policies that write joint velocities, whatever the mode they learnt from: these go"
        " to the robot unprotected, or through the filter that is named."
    )
    if intents:
        yield (
            "“Intent through the MPC” is a policy and a controller: the policy writes the operator's command,"
            " the masked MPC completes it and keeps it safe; against joint velocities, unprotected, that"
            " compares both at once, not the data."
        )
    if "ee" in design.modes:
        yield "The policies' default settings were chosen in trials with demonstrations of mode ee."


def _differs_twice(mode: str, baseline: str) -> bool:
    """Return whether both the operator's input and the controller are others than in the baseline mode."""
    one, other = MODES[mode], MODES[baseline]
    inputs = [(each.device, each.groups("base"), each.groups("hand")) for each in (one, other)]
    return inputs[0] != inputs[1] and one.controller != other.controller


def _intervals(results: Sequence[TaskResults]) -> Iterator[str]:
    conditions = [
        condition for each in results for condition in (each.policies.conditions if each.policies else ())
    ]
    if not conditions:
        return
    several = any(len(condition.seeds) > 1 for condition in conditions)
    together = "; rollouts of several policies in one scene count together" if several else ""
    yield f"Intervals are 95 %. “These policies”: Wilson, for these very policies in any scenes{together}."
    if several:
        yield (
            "“With training”: the wider of a nested bootstrap over dataset draws, training seeds and scenes"
            " and of Student's t over training seeds (over draws where there are several)."
        )
    else:
        yield "There is one training seed: how much another would differ is in none of the intervals."
    if any(each.disturbed or each.protected for each in results):
        yield "“Without” is the same policies in the same scenes, undisturbed and unprotected."


def _tests(results: Sequence[TaskResults]) -> Iterator[str]:
    found = [*_differences([each.policies for each in results])]
    found += _differences([each.shielded for each in results])
    if not found:
        return
    exact = {
        "exact McNemar test where the same scenes were met, each scene counted once": True,
        "Boschloo's test where not": False,
    }
    used = {each.rollouts.paired for each in found}
    names = " or ".join(name for name, paired in exact.items() if paired in used)
    nested = ", nested bootstrap and Welch's t test over trained policies, the largest p of the three"
    yield f"Differences: Newcombe's method 10; {names}{nested if any(each.nested for each in found) else ''}."
    told = families(each.family for each in found)
    yield (
        f"p is adjusted by Holm over {told} of all tasks. Which family a comparison belongs to follows from"
        " what is compared, never from what came out. “Detectable” is what would be seen as a difference in"
        " 80 % of such studies."
    )


def _differences(found: Sequence[Outcomes | None]) -> list[OutcomeDifference]:
    return [each for outcomes in found if outcomes for each in outcomes.differences]
