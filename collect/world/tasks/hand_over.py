"""Take a bar with one hand, give it to the other in the air, and put it into a bin with that one."""

from dataclasses import dataclass

import numpy as np

from handrail.collect.world.task import Start, TaskState, Verdict
from handrail.collect.world.tasks.catalogue import check_robot
from handrail.collect.world.tasks.pick_place import PickPlace
from handrail.controllers.robot.model import RobotModel

_AT = 0.08  # beside or above the bar's middle that is at it [m]
_LONG = (1.0, 0.4, 1.0)  # of that, one over how much farther it is along the bar


@dataclass(frozen=True)
class HandOver(PickPlace):
    """As `PickPlace` with a bar; its table is for the hand that begins alone, the bin's for the other.

    Success: the bar at rest inside the bin, both grippers open and away from it.
    Failure: the bar on the floor; the bar over a table with the hand at it that the table is not for.
    """

    description: str = "Take the bar with one hand, hand it over to the other, and put it into the bin."
    length: float = 0.34

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Draw tables, bar, bin, obstacles and the robot's start."""
        check_robot("hand_over", model.description)
        return super().sample(model, rng)

    def outcome(self, state: TaskState) -> Verdict:
        """Judge as `PickPlace` does, and which hand is at the bar."""
        verdict, bar = super().outcome(state), state.pose("cube")
        ways = [bar.rotation.T @ (tool.position - bar.position) for tool in state.tools]
        at = [bool(np.linalg.norm(way * _LONG) < _AT) for way in ways]
        for name, hand in (("cube_table", 1 - state.hand), ("bin_table", state.hand)):
            table = state.object(name)
            over = np.abs(bar.position[:2] - table.position[:2]) < table.shape.size[:2] / 2
            if at[hand] and over.all():
                return Verdict(failure="wrong_hand")
        left = verdict.success and not any(at) and state.let_go(bar.position, 1 - state.hand)
        return Verdict(left, verdict.failure)
