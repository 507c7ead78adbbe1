"""The operators by name; light to import."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from handrail.controllers.registry import Registry


@dataclass(frozen=True)
class OperatorSpec:
    """An operator: one entry makes it.

    Attributes:
        name: as on the command line, and what the dataset says of who steered.
        build: `(model, mode, task, human) -> Operator`, or where that is, `module:name`. It gets the robot's
            model, the `TeleopMode`, the `TaskSpec`, and the `HumanSettings` of the person.
        help: one line.
    """

    name: str
    build: Callable[..., Any] | str
    help: str


OPERATORS = Registry(
    "operator",
    OperatorSpec,
    (
        OperatorSpec(
            "scripted",
            "handrail.collect.operators.scripts.scripted:scripted_operator",
            "a script with a human-like hand",
        ),
    ),
)
