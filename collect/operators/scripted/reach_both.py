"""How an operator brings two hands to a pose each: one after the other."""

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.phases import PhasedScript, ScriptPhase, turns
from handrail.collect.world.tasks.reach_both import OTHER

_AHEAD = 0.6  # of the hands' middle from the base's centre, at scale 1 [m]


class ReachBothScript(PhasedScript):
    """Reaches both goals of `handrail/ReachBoth-v0`; a script."""

    def replan(self, view: View, name: str) -> list[ScriptPhase] | None:
        """Begin again when the second hand is there: the first may have been moved."""
        return self.plan(view) if name == "other" else None

    def plan(self, view: View) -> list[ScriptPhase]:
        """Return the way of one hand, then of the other; the base stands before the middle of both goals."""
        task, goal, other = view.task, view.task.goal or view.tool, view.task.pose(OTHER)
        sides = (goal, other) if task.hand == 0 else (other, goal)
        x, y, _ = sides[0].position - sides[1].position
        yaw = float(np.arctan2(-x, y))
        middle = (goal.position + other.position)[:2] / 2
        place = middle - _AHEAD * self._scale * np.array([np.cos(yaw), np.sin(yaw)])
        near = {"distance": 0.05 * self._scale, "angle": 0.2, "patience": 20.0}
        one = ScriptPhase(goal, np.array([*place, yaw]), name="one", **near)
        return [
            *turns(False, 0.0, [one]),
            *turns(True, 0.0, [ScriptPhase(other, one.base, name="other", **near)]),
        ]
