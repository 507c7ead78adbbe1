"""How an operator carries a box with both hands from one table to another."""

from functools import partial

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.phases import PhasedScript, Route, ScriptPhase, from_phase
from handrail.collect.operators.scripted.pick_place import above
from handrail.collect.world.tasks.carry_box import APART, GRASP
from handrail.collect.world.tasks.postures import hand_rotation
from handrail.controllers.arrays import FloatArray

_AHEAD = 0.72  # hands before the base's centre while carrying [m]
_OVER = 0.16  # hands above where they hold it, while they carry it [m]
_INSIDE = 0.19  # the box's middle behind the table's edge [m]


class CarryBoxScript(PhasedScript):
    """Approach, grasp, lift, carry, put down with a pair of hands for `handrail/CarryBox-v0`; a script."""

    def replan(self, view: View, name: str) -> list[ScriptPhase] | None:
        """Grasp again when the box stayed behind."""
        stayed = view.task.pair.position[2] - view.task.pose("box").position[2] > GRASP[2] + 0.04
        return from_phase(self.plan(view), "above") if name == "lift" and stayed else None

    def plan(self, view: View) -> list[ScriptPhase]:
        """Return the way to the box, over to the other table, and what is done at both."""
        task, route = view.task, Route(self._model, view.task)
        now, tables = task.pose("box"), [task.object(name) for name in ("box_table", "table")]
        down = hand_rotation(now.rotation[:, 0], [0.0, 0.0, -1.0])
        ahead = hand_rotation([1.0, 0.0, 0.0], [0.0, 0.0, -1.0])
        pick = now.position + now.rotation @ GRASP
        table, lifted = tables[1], above(pick, _OVER)
        place = np.array([table.front + _INSIDE, table.position[1], table.top + pick[2] - tables[0].top])
        height = max(pick[2], place[2]) + _OVER
        stands = [np.array([where[0] - _AHEAD, where[1], 0.0]) for where in (pick, place)]

        def crossing(name: str, side: FloatArray, gripper: float = 1.0) -> ScriptPhase:
            lane = np.array([route.lane, side[1], 0.0])
            near = {"apart": APART, "distance": 0.12, "angle": 0.3, "gripper": gripper}
            return ScriptPhase.at(name, np.array([route.lane + _AHEAD, side[1], height]), ahead, lane, **near)

        at = partial(ScriptPhase.at, rotation=down, base=stands[0], apart=APART)
        pick_up = [
            at("above", above(pick, 0.12), distance=0.02, angle=0.08),
            at("descend", pick, distance=0.012, angle=0.08, pace=0.4, patience=8.0),
            at("grasp", pick, distance=1.0, angle=3.2, gripper=1.0, dwell=1.2),
            at("lift", lifted, distance=0.04, angle=0.2, gripper=1.0, pace=0.5),
        ]
        at = partial(ScriptPhase.at, rotation=ahead, base=stands[1], apart=APART)
        put_down = [
            at("over", above(place, 0.10), distance=0.03, angle=0.15, gripper=1.0),
            at("lower", above(place, 0.008), distance=0.012, angle=0.3, gripper=1.0, pace=0.3, patience=8.0),
            at("release", above(place, 0.008), distance=1.0, angle=3.2, dwell=1.0),
            at("rise", above(place, 0.20), distance=0.03, angle=0.3),
        ]
        first = [crossing("approach", pick, 0.0)] if route.blocked(view.state.q[:2], stands[0][:2]) else []
        return [*first, *pick_up, crossing("retreat", pick), crossing("cross", place), *put_down]
