"""What LeRobot calls Handrail's numbers: `lerobot-rollout` takes only names that end in `.pos` or `.vel`.

    tool.x → tool.x.pos    goal.qw → goal.qw.pos    gripper → gripper.pos    mover_0.vx → mover_0.x.vel
    ee.vx → ee.x.vel       ee.wz → ee.wz.vel        joint.elbow_joint → joint.elbow_joint.vel

Handrail's own columns keep their names. An action may still have the old ones, as older datasets have.
"""

from collections.abc import Mapping

from handrail.collect.processor.units import POSITION, VELOCITY

_LINEAR, _ANGULAR = ("vx", "vy", "vz"), ("wx", "wy", "wz")


def lerobot_name(name: str) -> str:
    """Return LeRobot's name of a number of the robot, of the scene, or of an action."""
    head, _, part = name.rpartition(".")
    if name.endswith((POSITION, VELOCITY)):
        return name
    if part in _LINEAR:
        return f"{head}.{part[1:]}{VELOCITY}"
    return name + (VELOCITY if part in _ANGULAR or head == "joint" else POSITION)


def named(name: str, action: Mapping[str, float]) -> float | None:
    """Return a number of an action by LeRobot's name or by Handrail's own; None if it has neither."""
    return action.get(lerobot_name(name), action.get(name))
