"""How an operator carries a tray past obstacles and puts it down on a table."""

from functools import partial

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.phases import PhasedScript, Route, ScriptPhase
from handrail.collect.world.tasks.postures import reach_share
from handrail.collect.world.tasks.tray import APART, HANDLE
from handrail.controllers.robot.model import Pose

_OVER = 0.10  # the tray above the table while it comes near [m]
_ABOVE = 0.012  # the tray above the table when it is let go [m]
_INSIDE = 0.22  # the tray's middle behind the table's edge [m]
_DOWN = np.diag([1.0, -1.0, -1.0])  # of the tool: pointing down, its x ahead
_TILT = 0.06  # that a person who minds the can allows on the way [rad]
_AHEAD = 1.0  # hand before the base's centre while carrying, with an arm that reaches as far as usual [m]


class TrayScript(PhasedScript):
    """Cross behind the obstacles, go up to the table, put down, let go for `handrail/Tray-v0`; a script."""

    def plan(self, view: View) -> list[ScriptPhase]:
        """Return the way to the table, and what is done there."""
        route, table = Route(self._model, view.task), view.task.object("table")
        place = np.array([table.front + _INSIDE, table.position[1], table.top + HANDLE[2] + _ABOVE])
        stand = route.stand(place, table.front)
        over, up = (place + np.array([0.0, 0.0, rise]) for rise in (_OVER, _OVER + 0.08))
        apart = APART if len(view.task.start.grip) > 1 else 0.0
        at = partial(ScriptPhase.at, rotation=_DOWN, base=stand, apart=apart)
        phases = [
            at("over", over, distance=0.02, angle=0.15, pace=0.7, tilt=_TILT, gripper=1.0),
            at("lower", place, distance=0.012, angle=3.2, pace=0.25, tilt=_TILT, patience=8.0, gripper=1.0),
            at("release", place, distance=1.0, angle=3.2, dwell=1.0),
            at("rise", up, distance=0.03, angle=3.2, tilt=_TILT),
        ]
        if self._drives:
            return route.drive(view.state.q[:3], stand, Pose(over, _DOWN), 1.0) + phases
        height = max(view.tool.position[2], place[2] + _OVER)
        crossing = np.array([route.lane + _AHEAD * reach_share(self._model), place[1], height])
        lane = np.array([route.lane, place[1], 0.0])
        near = {"gripper": 1.0, "distance": 0.12, "angle": 0.4, "apart": apart}
        cross = ScriptPhase.at("cross", crossing, _DOWN, lane, **near)
        return [cross, *phases]
