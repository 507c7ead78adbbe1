"""The declarations of a study before it begins: contrasts of its policies, of any kind, that are tested."""

from collections.abc import Mapping
from dataclasses import dataclass

from handrail.policies.study.design import StudyDesign

Parts = Mapping[str, float]  # the weight of each policy's success, by its label


@dataclass(frozen=True)
class Declared:
    """A contrast that is tested: Σ w s of the success s of policies."""

    label: str
    parts: Parts  # w
    sd: float  # expected of a policy's success from draw to draw
    margin: float = 0.0  # nearer than which both sides are equivalent; 0 where that is not tested


def declared(design: StudyDesign) -> list[Declared]:
    """Return what is declared: of pairs of modes, or of ways after the last round."""
    found = [
        Declared(
            *of_pair(each.one, each.other, " same number" * (each.budget == "number")), each.sd, each.margin
        )
        for each in design.pairs
    ]
    if rounds := design.rounds:
        found += [Declared(*of_ways(pair, rounds.count), rounds.sd) for pair in rounds.primary]
    return found


def of_pair(one: str, other: str, ending: str = "") -> tuple[str, Parts]:
    """Return words and parts of one policy − another."""
    words = f" ({ending.strip()})" if ending else ""
    return f"{one} − {other}{words}", {f"{one}{ending}": 1.0, f"{other}{ending}": -1.0}


def of_ways(pair: tuple[str, str], number: int) -> tuple[str, Parts]:
    """Return words and parts of two ways after a round."""
    _, parts = of_pair(*(f"{way}-{number} intent" for way in pair))
    return f"{' − '.join(pair)} after round {number}", parts
