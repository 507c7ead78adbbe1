"""How an operator reaches a pose: near it with the base, then with the hand."""

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.phases import PhasedScript, ScriptPhase
from handrail.collect.operators.scripted.placement import standing_pose


class ReachScript(PhasedScript):
    """Reaches the goal of `handrail/Reach-v0`; a script."""

    def plan(self, view: View) -> list[ScriptPhase]:
        """Return the way: drive to where the goal is in comfortable reach, then steer the hand to it."""
        goal, q, scale = view.task.goal or view.tool, view.state.q, self._scale
        base = standing_pose(self._model, q, goal)
        reach = ScriptPhase(goal, base, name="reach", distance=0.06 * scale, angle=0.25)
        if self._drives and (np.hypot(*(base[:2] - q[:2])) > 0.4 * scale or abs(base[2] - q[2]) > 0.2):
            near = 0.15 * scale
            return [ScriptPhase(goal, base, name="drive", focus="base", distance=near, angle=0.2), reach]
        return [reach]
