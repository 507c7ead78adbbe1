"""How an operator pulls a drawer open."""

from functools import partial

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.phases import PhasedScript, ScriptPhase, from_phase
from handrail.collect.operators.scripted.placement import standing_within_reach
from handrail.collect.world.tasks.drawer import handle, handle_rotation, inward, opened
from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.robot.model import Pose, RobotModel

_PULL = 0.26  # how far the operator means to open it [m]
_ENOUGH = 0.21  # [m]
BACK = 0.16  # hand before the handle at the beginning and at the end [m]
_AWAY = 0.10  # from it that is far enough to leave it alone [m]


class DrawerScript(PhasedScript):
    """Approach, grasp, pull, let go for `handrail/Drawer-v0`; a script.

    Who drives the base by itself turns the hand first, where there is room, and drives up to the handle then.
    """

    def replan(self, view: View, name: str) -> list[ScriptPhase] | None:
        """Begin again at the handle when the drawer did not come along; leave it as long as it is near."""
        if name == "release" and opened(view.task) <= _ENOUGH:
            return from_phase(self.plan(view), "stage")
        bar = handle(view.task)
        if name != "release" and not (name == "leave" and np.linalg.norm(view.tool.position - bar) < _AWAY):
            return None
        into = inward(view.task.object("cabinet").rotation)
        rotation = handle_rotation(view.tool.rotation, into)
        base = view.state.q[:3] if self._model.description.base.joints else np.zeros(3)
        options = {"distance": 0.03, "angle": 3.2, "pace": 0.5, "patience": 5.0}
        return [ScriptPhase.at("leave", bar - BACK * into, rotation, base, **options)]

    def plan(self, view: View) -> list[ScriptPhase]:
        """Return the way to the handle, how to pull it, and how to let go."""
        way = way_to_handle(self._model, view, handle(view.task), 0.02)
        into, bar, base = inward(view.task.object("cabinet").rotation), way[-1].hand, way[-1].base
        pull = max(_PULL - opened(view.task), 0.05)
        back = base - np.array([pull * into[0], pull * into[1], 0.0])
        at = partial(ScriptPhase.at, position=bar.position - pull * into, rotation=bar.rotation, base=back)
        phases = [
            *way,
            at("pull", distance=0.03, angle=3.2, gripper=1.0, pace=0.5, patience=15.0),
            at("release", distance=1.0, angle=3.2, dwell=0.8),
        ]
        if not self._drives:
            return phases
        hand, now = phases[0].hand, view.state.q[:3]
        ready = ScriptPhase(before_driving(hand, base, now), now, name="ready", distance=0.05, angle=0.15)
        drive = ScriptPhase(hand, base, name="drive", focus="base", distance=0.08, angle=0.08)
        return [ready, drive, *phases]


def way_to_handle(model: RobotModel, view: View, bar: FloatArray, near: float) -> list[ScriptPhase]:
    """Return how the hand gets before a place of the handle, (3,), so near [m], then there, and grasps."""
    into = inward(view.task.object("cabinet").rotation)
    grasp, yaw = handle_rotation(view.tool.rotation, into), float(np.arctan2(into[1], into[0]))
    base = standing_within_reach(model, view.state.q, Pose(bar, grasp), yaw)
    at = partial(ScriptPhase.at, rotation=grasp, base=base)
    return [
        at("stage", bar - BACK * into, distance=near, angle=0.10),
        at("approach", bar, distance=0.010, angle=0.10, pace=0.4, patience=8.0),
        at("grasp", bar, distance=1.0, angle=3.2, gripper=1.0, dwell=1.2),
    ]


def before_driving(hand: Pose, base: FloatArray, now: FloatArray) -> Pose:
    """Return where the hand is to be while the base is at `now`, so that driving to `base` brings it along.

    `p = p_now + R_z(θ_now − θ) (p_hand − p_base)`, and the rotation likewise.
    """
    turn = matrix_from_rpy([0.0, 0.0, now[2] - base[2]])
    away = hand.position - [base[0], base[1], 0.0]
    return Pose(turn @ away + [now[0], now[1], 0.0], turn @ hand.rotation)
