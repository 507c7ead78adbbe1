"""How an operator brings two hands to a pose each: one after the other; with short arms both at once."""

from functools import partial

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
        """Return the way of one hand, then of the other; short arms first try both at once."""
        task, goal, other = view.task, view.task.goal or view.tool, view.task.pose(OTHER)
        x, y, _ = (goal.position - other.position) * (1 if task.hand == 0 else -1)
        yaw = float(np.arctan2(-x, y))
        ahead = _AHEAD * self._scale * np.array([np.cos(yaw), np.sin(yaw)])
        base = np.array([*((goal.position + other.position)[:2] / 2 - ahead), yaw])
        q = np.concatenate([base, self._model.description.home[3:]])
        home = [self._model.pose(q, hand.named("tool")) for hand in self._model.description.hands]
        near = partial(ScriptPhase, base=base, distance=0.05 * self._scale, angle=0.2, patience=20.0)
        one, two = turns(False, 0.0, [near(goal)]), turns(True, 0.0, [near(other, name="other")])
        if np.count_nonzero(self._model.moving) - len(self._model.description.base.joints) >= 6:
            return [*one, *two]
        before = near(home[task.hand], also=home[1 - task.hand], patience=10.0)
        return [before, near(goal, also=other, distance=0.0, patience=12.0), *one, *two]
