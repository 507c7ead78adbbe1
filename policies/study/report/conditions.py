"""What the conditions of a study are, and which of them are compared with which."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from handrail.controllers.errors import unknown_name
from handrail.datasets.comparison.outcomes import LIKE_FOR_LIKE, Pair
from handrail.policies.study.design.design import StudyDesign
from handrail.policies.study.design.jobs import Actions, Cell, StudyPolicy

CONTROLLER = "policy-plus-controller"
PROTECTED = "protected"
FAMILIES = (LIKE_FOR_LIKE, PROTECTED, CONTROLLER)  # of comparisons, in the order to be read


@dataclass(frozen=True)
class StudyCondition:
    """What a condition is, field by field.

    Attributes:
        mode: in which the demonstrations were made.
        actions: what the policy writes, `realised` joint velocities or the operator's `intent`.
        budget: how much it was trained on, `time` or `number`.
        treatment: what disturbs or protects, `pushed` or `filter`; "" for neither.
    """

    mode: str
    actions: Actions
    budget: str
    treatment: str = ""

    @property
    def label(self) -> str:
        """What the policies are called under whatever treatment."""
        return StudyPolicy(Cell("", self.mode), self.actions, self.budget, 0).label

    @property
    def family(self) -> str:
        """Which family of comparisons it belongs to: p is adjusted over all of one, for every task."""
        if self.actions == "intent":
            return CONTROLLER
        return PROTECTED if self.treatment else LIKE_FOR_LIKE


def identify(design: StudyDesign, labels: Sequence[str]) -> dict[str, StudyCondition]:
    """Return what the conditions of evaluation files are, like for like first: velocities, then intents.

    A label says mode, actions and budget, then the treatment; this is the only place where one is read.

    Raises:
        HandrailError: a condition is not of the study.
    """
    spaces: tuple[Actions, ...] = ("realised", "intent")
    kinds = [StudyCondition(*each) for each in product(design.modes, spaces, design.budgets)]
    known = {kind.label: kind for kind in kinds}
    found = {label: _identified(label, known) for label in labels}
    return dict(sorted(found.items(), key=lambda item: _place(item[1], design)))


def _identified(label: str, known: Mapping[str, StudyCondition]) -> StudyCondition:
    own = max((each for each in known if f"{label} ".startswith(f"{each} ")), key=len, default=None)
    if own is None:
        raise unknown_name("condition of the evaluations", label, known)
    kind = known[own]
    return StudyCondition(kind.mode, kind.actions, kind.budget, label.removeprefix(own).strip())


def _place(condition: StudyCondition, design: StudyDesign) -> tuple[int, bool, int]:
    return (
        design.budgets.index(condition.budget),
        condition.actions == "intent",
        design.modes.index(condition.mode),
    )


def pairs(conditions: Mapping[str, StudyCondition], baseline: str) -> list[Pair]:
    """Return what is compared with what: like for like apart from a policy plus a controller.

    That is the baseline mode's joint velocities on the same budget under the same treatment. A condition for
    which there is none (yet) is compared with nothing.
    """
    base = {
        (condition.budget, condition.treatment): label
        for label, condition in conditions.items()
        if (condition.mode, condition.actions) == (baseline, "realised")
    }
    against = {
        label: base.get((condition.budget, condition.treatment)) for label, condition in conditions.items()
    }
    return [
        Pair(label, other, conditions[label].family)
        for label, other in against.items()
        if other and other != label
    ]
