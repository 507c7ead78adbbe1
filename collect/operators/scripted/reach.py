"""How an operator reaches a pose: near it with the base, then with the hand."""

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.phases import PhasedScript, ScriptPhase
from handrail.collect.operators.scripted.placement import standing_pose


class ReachScript(PhasedScript):
    """Reaches the goal of `handrail/Reach-v0`; a script."""

    def plan(self, view: View) -> list[ScriptPhase]:
        """Return the way: drive to where the goal is in comfortable reach, then steer the hand to it."""
        goal = view.task.goal or view.tool
        base = standing_pose(self._model, view.state.q, goal)
        phases = [ScriptPhase(goal, base, name="reach", distance=0.06 * self._scale, angle=0.25)]
        far = (
            np.hypot(*(base[:2] - view.state.q[:2])) > 0.4 * self._scale
            or abs(base[2] - view.state.q[2]) > 0.2
        )
        if self._drives and far:
            near = 0.15 * self._scale
            phases.insert(0, ScriptPhase(goal, base, name="drive", focus="base", distance=near, angle=0.2))
        return phases
