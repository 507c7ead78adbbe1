"""What a study declares before it begins: contrasts of its policies, of whatever kind, that are tested."""

from collections.abc import Mapping
from dataclasses import dataclass

from handrail.policies.study.design import Factors, StudyDesign

WORDS = {
    "input": "input: hand − joints",
    "controller": "controller: MPC − none",
    "interaction": "interaction: what the MPC adds with the hand − with the joints",
}
_SIGNS = {"input": (1, 1, -1, -1), "controller": (1, -1, 1, -1), "interaction": (2, -2, -2, 2)}
Parts = Mapping[str, float]  # the weight of each policy's success, by its label


@dataclass(frozen=True)
class Declared:
    """A contrast that is tested: Σ w s of the success s of policies."""

    label: str
    parts: Parts  # w
    sd: float  # expected of a policy's success from draw to draw
    margin: float = 0.0  # nearer than which both sides are equivalent; 0 where that is not tested

    @property
    def name(self) -> str:
        """What it is called in short."""
        return self.label.partition(":")[0]


def declared(design: StudyDesign) -> list[Declared]:
    """Return what is declared: of the factors, of pairs of modes, or of ways after the last round."""
    found = [
        Declared(
            *of_pair(each.one, each.other, " same number" * (each.budget == "number")), each.sd, each.margin
        )
        for each in design.pairs
    ]
    if factors := design.factors:
        found += [Declared(*of_factors(factors, name), factors.sd) for name in factors.primary]
    if rounds := design.rounds:
        found += [Declared(*of_ways(pair, rounds.count), rounds.sd) for pair in rounds.primary]
    return found


def of_factors(factors: Factors, name: str, ending: str = "") -> tuple[str, Parts]:
    """Return words and parts of a contrast of the 2 × 2.

    `input`: hand − joint, mean over both controllers. `controller`: MPC − none, mean over both inputs.
    `interaction`: (MPC − none with the hand) − (MPC − none with the joints).

    Args:
        factors: of the study.
        name: which.
        ending: what the labels of its policies have after the mode.
    """
    parts = {f"{mode}{ending}": sign / 2.0 for mode, sign in zip(factors.modes, _SIGNS[name], strict=True)}
    return f"{WORDS[name]}{_bracketed(ending)}", parts


def of_pair(one: str, other: str, ending: str = "") -> tuple[str, Parts]:
    """Return words and parts of one policy − another."""
    return f"{one} − {other}{_bracketed(ending)}", {f"{one}{ending}": 1.0, f"{other}{ending}": -1.0}


def of_ways(pair: tuple[str, str], number: int) -> tuple[str, Parts]:
    """Return words and parts of two ways after a round."""
    _, parts = of_pair(*(f"{way}-{number} intent" for way in pair))
    return f"{' − '.join(pair)} after round {number}", parts


def _bracketed(ending: str) -> str:
    return f" ({ending.strip()})" if ending else ""
