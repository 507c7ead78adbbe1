"""Which column of a dataset plays which part; the defaults fit Handrail's and plain LeRobot's datasets."""

from dataclasses import dataclass

from handrail.datasets.lists import Names


@dataclass(frozen=True)
class ColumnNames:
    """Names of columns; of several, the first that a dataset has."""

    state: Names = "observation.state"
    """The robot's measurement of itself."""
    action: Names = "action"
    """The command."""
    asked: Names = "teleop.values, teleop.input, teleop.raw"
    """The operator's input, one entry an axis: the velocity asked for, or a reading."""
    owned: Names = "teleop.mask"
    """Which of these the operator owned."""
    mode: Names = "teleop.mode"
    """The teleop mode."""
    phase: Names = "phase, subtask, subtask_index"
    """The phase of the task; without one, phases end where the gripper opens or closes."""
    distance: Names = "controller.smallest_distance"
    """Smallest signed distance to a collision [m]."""
    contacts: Names = "safety.contacts"
    """How many unwanted contacts there were in the period."""
    impulse: Names = "safety.impulse"
    """Impulse of unwanted contacts in the period [N s]."""
    device: Names = "teleop.device"
    """The operator's device; empty for a script or a policy."""
    age: Names = "teleop.age"
    """Age of the input when it became a command [s]."""
    round_trip: Names = "teleop.round_trip"
    """From what the device's screen showed to the answer [s]."""
    undos: Names = "teleop.undos"
    """How often the operator has gone back in the episode so far."""
    owner: Names = "owner"
    """The owner of each channel beside a policy: 0 nobody, 1 the policy, 2 the person, 3 both."""
    intervention: Names = "intervention"
    """Whether the person owned something beside a policy."""
    slack: Names = "controller.slack"
    """Largest violation of a soft limit in the plan."""

    def choices(self, part: str) -> tuple[str, ...]:
        """Return the names that a part may have, in order of preference."""
        return tuple(name.strip() for name in getattr(self, part).split(",") if name.strip())
