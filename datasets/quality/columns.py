"""Which column of a dataset plays which part; the defaults fit Handrail's and plain LeRobot's datasets."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ColumnNames:
    """Names of columns; of several, comma-separated, the first that a dataset has."""

    state: str = "observation.state"
    """What the robot measured of itself."""
    action: str = "action"
    """What was commanded."""
    asked: str = "teleop.raw, teleop.input, teleop.values"
    """What the operator put in, one entry an input axis."""
    owned: str = "teleop.mask"
    """Which of these the operator owned."""
    mode: str = "teleop.mode"
    """The teleop mode."""
    phase: str = "phase, subtask, subtask_index"
    """The phase of the task; without one, phases end where the gripper opens or closes."""
    distance: str = "controller.smallest_distance"
    """Smallest signed distance to a collision [m]."""
    contacts: str = "safety.contacts"
    """How many unwanted contacts there were in the period."""
    impulse: str = "safety.impulse"
    """Impulse of unwanted contacts in the period [N s]."""
    slack: str = "controller.slack"
    """Largest violation of a soft limit in the plan."""

    def choices(self, part: str) -> tuple[str, ...]:
        """Return the names that a part may have, in order of preference."""
        return tuple(name.strip() for name in getattr(self, part).split(",") if name.strip())
