"""The arbiters by name; light to import."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from msgspec import Meta

from handrail.controllers.registry import Registry
from handrail.controllers.typed import NonNegative, check_settings


@dataclass(frozen=True)
class ArbiterSettings:
    """Numbers of the arbiters."""

    handback: NonNegative = 0.5
    """How long after it was moved last a channel stays the person's [s]."""
    alpha: Annotated[float, Meta(ge=0, le=1)] = 0.5
    """The policy's share in blend."""

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_settings(self, "--arbitration")


@dataclass(frozen=True)
class ArbiterSpec:
    """An arbiter: one entry makes it."""

    name: str
    build: Callable[..., Any] | str
    help: str


ARBITERS = Registry(
    "arbiter",
    ArbiterSpec,
    (
        ArbiterSpec(
            "by_mask", "handrail.collect.operators.shared.by_input:by_mask", "what a person moves is theirs"
        ),
        ArbiterSpec(
            "whole", "handrail.collect.operators.shared.by_input:whole", "any input takes everything"
        ),
    ),
)
