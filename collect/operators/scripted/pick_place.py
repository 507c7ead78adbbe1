"""How an operator carries a cube from one table to a bin on another."""

from functools import partial

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.phases import PhasedScript, Route, ScriptPhase, from_phase
from handrail.collect.world.tasks.pick_place import grasp_rotation
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel

_HELD = 0.05  # a cube this near to the tool point is held [m]
_BELOW = 0.005  # finger tips below the middle of the cube [m]
_NEAR, _ALIGNED = 0.010, 0.10  # how exactly the hand has to be there to grasp [m, rad]
_RETREAT = 0.40  # hand behind the table's edge while carrying [m]
_AHEAD = 0.80  # hand before the base's centre while carrying [m]
_OVER = 0.30  # hand above what it goes to while carrying [m]


class PickPlaceScript(PhasedScript):
    """Approach, grasp, lift, carry, place for `handrail/PickPlace-v0`; a script."""

    def replan(self, view: View, name: str) -> list[ScriptPhase] | None:
        """Grasp again when the cube stayed behind."""
        cube = view.task.pose("cube").position
        if name != "lift" or np.linalg.norm(cube - view.tool.position) < _HELD * self._grip:
            return None
        return from_phase(self.plan(view), "above")

    def plan(self, view: View) -> list[ScriptPhase]:
        """Return the way to the cube, over to the bin, and what is done at both."""
        task, route, scale = view.task, Route(self._model, view.task), self._scale
        cube, goal = task.pose("cube"), task.pose("bin").position
        down = grasp_rotation(view.tool.rotation, cube.rotation)
        pick, place = cube.position, goal
        edges = [task.object(name).front for name in ("cube_table", "bin_table")]
        stands = [route.stand(thing, edge) for thing, edge in zip((pick, place), edges, strict=True)]
        ahead, lane = _AHEAD * scale, route.lane
        over = pick[2] + _OVER * scale
        stage = np.array([edges[0] - 0.15 * scale, pick[1], over])
        first = ScriptPhase.at("stage", stage, down, stands[0], distance=0.10 * scale, angle=0.30)
        begin = [first]
        if self._drives:
            *across, up = route.drive(view.state.q[:3], stands[0], first.hand, 0.0)
            base = across[-1].base if across else view.state.q  # there the arm is folded first
            hand = np.array([base[0] + ahead, base[1], over])
            ready = ScriptPhase.at("ready", hand, down, base, distance=0.15 * scale, angle=0.5)
            begin = [*across, ready, up, first]
        elif route.blocked(view.state.q[:2], stands[0][:2]):
            hand, base = np.array([lane + ahead, pick[1], over]), np.array([lane, pick[1], 0.0])
            begin.insert(0, ScriptPhase.at("approach", hand, down, base, distance=0.15 * scale, angle=0.5))

        height = max(pick[2], place[2]) + _OVER * scale

        def carry(name: str, x: float, y: float, base: FloatArray) -> ScriptPhase:
            near = {"distance": 0.12 * scale, "angle": 0.4, "gripper": 1.0}
            return ScriptPhase.at(name, np.array([x, y, height]), down, base, **near)

        if self._drives:
            retreat = carry("retreat", stands[0][0] + ahead, pick[1], stands[0])
            front = carry("front", stands[1][0] + ahead, place[1], stands[1])
            way = [retreat, *route.drive(stands[0], stands[1], front.hand, 1.0)]
        else:
            way = [
                carry("retreat", lane + ahead, pick[1], np.array([lane, pick[1], 0.0])),
                carry("cross", lane + ahead, place[1], np.array([lane, place[1], 0.0])),
                carry("front", edges[1] - _RETREAT * scale, place[1], stands[1]),
            ]
        rim = above(place, task.object("bin").top - place[2])
        taking = self._pick(view, pick, down, stands[0])
        return [*begin, *taking, *way, *self._place(rim, down, stands[1])]

    def _room(self, view: View) -> float:
        """Return how far beside the cube the hand may be for the open fingers to close around it [m].

        `(stroke − w (cos a + sin a)) / 2` for a cube of width w that is turned by a; as much either way.
        """
        gripper, near = self._model.hand.gripper, _NEAR * self._grip
        width = float(view.task.object("cube").shape.size[0])
        turned = width * (np.cos(_ALIGNED) + np.sin(_ALIGNED))
        return near if gripper is None else max(near, (gripper.stroke - turned) / 2)

    def _pick(self, view: View, cube: FloatArray, down: FloatArray, base: FloatArray) -> list[ScriptPhase]:
        """Go above the cube, down until it is between the fingers, close them, lift."""
        grip, at = self._grip, partial(ScriptPhase.at, rotation=down, base=base)
        room, grasp = self._room(view), above(cube, round(tips_beyond_tool(self._model) - _BELOW * grip, 6))
        return [
            at("above", above(cube, 0.14 * grip), distance=0.02 * grip, angle=0.10),
            at("descend", grasp, distance=_NEAR * grip, beside=room, angle=_ALIGNED, pace=0.4, patience=8.0),
            at("grasp", grasp, distance=1.0, angle=3.2, gripper=1.0, dwell=1.2),
            at("lift", above(cube, 0.22 * grip), distance=0.04 * grip, angle=0.3, gripper=1.0, pace=0.6),
        ]

    def _place(self, rim: FloatArray, down: FloatArray, base: FloatArray) -> list[ScriptPhase]:
        """Go over the bin's rim, down, open the fingers, rise."""
        grip, at = self._grip, partial(ScriptPhase.at, rotation=down, base=base)
        over, low, high = (above(rim, rise * grip) for rise in (0.18, 0.045, 0.25))
        return [
            at("over", over, gripper=1.0, distance=0.03 * grip, angle=0.3),
            at("lower", low, gripper=1.0, distance=0.025 * grip, angle=0.3, pace=0.4),
            at("release", low, distance=1.0, angle=3.2, dwell=0.8),
            at("rise", high, distance=0.05 * grip, angle=0.5),
        ]


def above(position: FloatArray, height: float) -> FloatArray:
    """Return a place above another, (3,) [m]."""
    return position + np.array([0.0, 0.0, height])


def tips_beyond_tool(model: RobotModel) -> float:
    """Return how far the finger tips are beyond the tool point [m]; 0 of a robot without fingers."""
    gripper, home = model.hand.gripper, model.description.home
    if gripper is None:
        return 0.0
    frame, tool = model.pose(home, gripper.frame), model.pose(home)
    offset = gripper.placement.translation[2] + gripper.tip
    return float(offset - frame.rotation[:, 2] @ (tool.position - frame.position))
