"""What stands around a robot, as a saved processor says it."""

from typing import Any

import numpy as np

from handrail.controllers.entries import Entry, check_entries, is_number, is_positive, is_text, lists
from handrail.controllers.errors import HandrailError, shown
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.robot.shape import Obstacle, Shape

_ENTRIES = {
    "name": Entry("a name", is_text),
    "kind": Entry("box, capsule, sphere or cylinder", is_text),
    "size": Entry("lengths [m]", lists(is_positive)),
    "position": Entry("three numbers [m]", lists(is_number, 3)),
    "rpy": Entry("three angles [rad]", lists(is_number, 3), needed=False),
    "work_surface": Entry("true or false", lambda value: isinstance(value, bool), needed=False),
}


def parsed_obstacles(tables: Any) -> tuple[Obstacle, ...]:
    """Return obstacles from their tables.

    Raises:
        HandrailError: a table is wrong, or two have one name.
    """
    if not isinstance(tables, list):
        raise HandrailError(f"obstacles: expected a list of tables, got {shown(tables)}")
    for table in tables:
        check_entries(table, _ENTRIES, "obstacle")
    names = [table["name"] for table in tables]
    if len(set(names)) != len(names):
        raise HandrailError(f"obstacles: expected each name once, got {', '.join(names)}")
    return tuple(
        Obstacle(
            table["name"],
            Shape(table["kind"], np.array(table["size"], dtype=float)),
            np.array(table["position"], dtype=float),
            matrix_from_rpy(table.get("rpy", (0.0, 0.0, 0.0))),
            work_surface=table.get("work_surface", False),
        )
        for table in tables
    )
