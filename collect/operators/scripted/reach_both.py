"""How an operator brings two hands to a pose each: both before the goals, then both to them."""

from functools import partial

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.phases import PhasedScript, ScriptPhase, turns
from handrail.collect.world.tasks.reach_both import OTHER

_AHEAD = 0.6  # of the hands' middle from the base's centre, at scale 1 [m]


class ReachBothScript(PhasedScript):
    """Reaches both goals of `handrail/ReachBoth-v0`; a script."""

    def replan(self, view: View, name: str) -> list[ScriptPhase] | None:
        """Begin again when one hand after the other did not do either."""
        return self.plan(view) if name == "other" else None

    def plan(self, view: View) -> list[ScriptPhase]:
        """Return the way: hands as at home before both goals, then both to these; if not, one by one."""
        task, goal, other = view.task, view.task.goal or view.tool, view.task.pose(OTHER)
        x, y, _ = (goal.position - other.position) * (1 if task.hand == 0 else -1)
        yaw = float(np.arctan2(-x, y))
        ahead = _AHEAD * self._scale * np.array([np.cos(yaw), np.sin(yaw)])
        base = np.array([*((goal.position + other.position)[:2] / 2 - ahead), yaw])
        q = np.concatenate([base, self._model.description.home[3:]])
        home = [self._model.pose(q, hand.named("tool")) for hand in self._model.description.hands]
        at = partial(ScriptPhase, base=base, distance=0.05 * self._scale, angle=0.2)
        return [
            at(home[task.hand], also=home[1 - task.hand], patience=10.0),
            at(goal, also=other, distance=0.0, patience=12.0),
            *turns(False, 0.0, [at(goal, patience=10.0)]),
            *turns(True, 0.0, [at(other, name="other", patience=10.0)]),
        ]
