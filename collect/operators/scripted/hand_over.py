"""How an operator takes a bar with one hand, gives it to the other, and puts it into a bin."""

from dataclasses import replace

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.phases import Route, ScriptPhase, from_phase, turns
from handrail.collect.operators.scripted.pick_place import PickPlaceScript
from handrail.collect.world.tasks.pick_place import grasp_rotation
from handrail.collect.world.tasks.postures import hand_rotation
from handrail.controllers.arrays import FloatArray

_HANDS = 0.14  # each hand from the bar's middle while both hold it [m]
_APART = 0.5  # of the hands while they are steered as a pair [m]
_AHEAD = 0.72  # hands before the base's centre while they carry [m]
_OVER = np.array([0.0, 0.0, 0.30])  # hands above what they go to while they carry [m]
_EMPTY = 0.1  # share of the stroke below which a closed gripper holds nothing
_DOWN = hand_rotation([1.0, 0.0, 0.0], [0.0, 0.0, -1.0])


class HandOverScript(PickPlaceScript):
    """Take, carry, hand over, carry, place for `handrail/HandOver-v0`; a script.

    Both hands are driven as a pair; else one takes its turn, and the other one holds still.
    """

    def replan(self, view: View, name: str) -> list[ScriptPhase] | None:
        """Grasp again when the bar stayed behind; hand it over where it is then."""
        taking = bool(self._phases[0].second)
        if name == "above" and taking:  # the bar may have moved a little
            return from_phase(self._give(view), "descend")
        missed = name == "grasp" and taking and view.task.openings[1 - view.task.hand] < _EMPTY
        if name == "meet" or missed:
            return self._give(view)
        stayed = view.task.pose("cube").position[2] < view.task.object("cube_table").top + 0.08
        return from_phase(self.plan(view), "stage") if name == "lift" and stayed else None

    def plan(self, view: View) -> list[ScriptPhase]:
        """Return the way to the bar, how to take it, and the way back behind the obstacles."""
        task, route, bar = view.task, Route(self._model, view.task), view.task.pose("cube")
        stand, own = route.stand(bar.position, task.object("cube_table").front), bar.position + _half(view)
        down = grasp_rotation(task.tool.rotation, bar.rotation, 2)
        lane, behind = _back(route, own + _OVER)
        blocked = route.blocked(view.state.q[:2], stand[:2])
        meet = ScriptPhase.at("meet", behind, _DOWN, lane, gripper=1.0, distance=0.02, dwell=0.8)
        return [
            *([_pair("approach", view, behind, lane)] if blocked else []),
            _pair("stage", view, own + _OVER, stand),
            *turns(False, 0.0, self._pick(view, own, down, stand)),
            _pair("retreat", view, behind, lane, gripper=1.0, other=0.0),
            *turns(False, 0.0, [meet]),
        ]

    def _give(self, view: View) -> list[ScriptPhase]:
        """Return how the other hand takes the bar from the first, and the way to the bin with it."""
        task, route, goal = view.task, Route(self._model, view.task), view.task.object("bin")
        bar, tool, base = task.pose("cube"), task.tool, view.state.q[:3]
        stand = route.stand(goal.position, task.object("bin_table").front)
        down, up = grasp_rotation(tool.rotation, bar.rotation, 2), np.array([0.0, 0.0, 0.14])
        rim = goal.top_centre - _HANDS * _side(view)
        lane, behind = _back(route, rim + _OVER)
        above, *take = self._pick(view, bar.position - _half(view), down, base)[:3]
        give = ScriptPhase.at("give", tool.position, down, base, distance=1.0, angle=3.2, dwell=0.8)
        leave = ScriptPhase.at("leave", tool.position + up, down, base, distance=0.04, angle=0.3)
        return [
            *turns(True, 1.0, [replace(above, dwell=0.6), *take]),
            *turns(False, 1.0, [give, leave]),
            _pair("cross", view, behind, lane, 1, gripper=0.0, other=1.0),
            _pair("front", view, rim + _OVER, stand, 1, gripper=0.0, other=1.0),
            *turns(True, 0.0, self._place(rim, _DOWN, stand)),
        ]


def _side(view: View) -> FloatArray:
    """Return the way from the other hand to the one that begins, across the robot, (3,)."""
    own, other = view.task.tool, view.task.tools[1 - view.task.hand]
    return np.array([0.0, np.sign(own.position[1] - other.position[1]), 0.0])


def _half(view: View) -> FloatArray:
    """Return the way from the bar's middle to where the hand that begins holds it, (3,) [m]."""
    axis = view.task.pose("cube").rotation[:, 1]
    return _HANDS * axis * np.sign(axis @ _side(view))


def _back(route: Route, place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where the base is in the lane, (3,), and hands before it that were at a place, (3,) [m]."""
    return np.array([route.lane, place[1], 0.0]), np.array([route.lane + _AHEAD, *place[1:]])


def _pair(
    name: str, view: View, place: FloatArray, base: FloatArray, hand: int = 0, **grippers: float
) -> ScriptPhase:
    """Return the phase that drives both hands, the first one, or with `hand` the other, to a place, (3,)."""
    middle, near = place + (hand - 0.5) * _APART * _side(view), {"distance": 0.06, "angle": 0.2}
    return ScriptPhase.at(name, middle, _DOWN, base, apart=_APART, **near, **grippers)
