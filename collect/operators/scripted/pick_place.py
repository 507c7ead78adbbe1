"""How an operator carries a cube from one table to a bin on another."""

from dataclasses import dataclass

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.phases import PhasedScript, Route, ScriptPhase, from_phase
from handrail.collect.world.scene import SceneObject
from handrail.collect.world.tasks.pick_place import grasp_rotation
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import Pose, RobotModel

_HELD = 0.05  # a cube this near to the tool point is held [m]
_BELOW = 0.005  # finger tips below the middle of the cube [m]
_NEAR, _ALIGNED = 0.010, 0.10  # how exactly the hand has to be there to grasp [m, rad]
_RETREAT = 0.40  # hand behind the table's edge while carrying [m]
_AHEAD = 0.80  # hand before the base's centre while carrying [m]


@dataclass(frozen=True)
class _Place:
    """What matters of a table: the near edge's x, the height, and the thing on it."""

    edge: float
    thing: FloatArray


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
        task = view.task
        self._route = Route(self._model, task)
        cube = task.pose("cube")
        pick = _Place(task.object("cube_table").front, cube.position)
        place = _Place(task.object("bin_table").front, task.pose("bin").position)
        down = grasp_rotation(view.tool.rotation, cube.rotation)
        rim = task.object("bin").top - place.thing[2]
        phases = self._pick(pick, down, self._room(task.object("cube")))
        phases += self._carry(pick, place, down)
        phases += self._place(place, down, rim)
        lane = self._route.lane
        if self._drives:
            *across, up = self._route.drive(view.state.q[:3], self._stand(pick), phases[0].hand, 0.0)
            phases = [
                *across,
                self._ready(across[-1].base if across else view.state.q, pick, down),
                up,
                *phases,
            ]
        elif self._route.blocked(view.state.q[:2], self._stand(pick)[:2]):
            height = cube.position[2] + 0.30 * self._scale
            around = Pose(np.array([lane + _AHEAD * self._scale, cube.position[1], height]), down)
            base = np.array([lane, cube.position[1], 0.0])
            phases.insert(
                0, ScriptPhase(around, base, name="approach", distance=0.15 * self._scale, angle=0.5)
            )
        return phases

    def _ready(self, base: FloatArray, pick: _Place, down: FloatArray) -> ScriptPhase:
        """Return the phase that folds the arm before it is driven up to the table, from where the base is."""
        scale = self._scale
        hand = np.array([base[0] + _AHEAD * scale, base[1], pick.thing[2] + 0.30 * scale])
        return ScriptPhase(Pose(hand, down), base, name="ready", distance=0.15 * scale, angle=0.5)

    def _room(self, cube: SceneObject) -> float:
        """Return how far beside the cube the hand may be for the open fingers to close around it [m].

        `(stroke − w (cos a + sin a)) / 2` for a cube of width w that is turned by a; as much either way.
        """
        gripper = self._model.description.end_effector.gripper
        width = float(cube.shape.size[0]) * (np.cos(_ALIGNED) + np.sin(_ALIGNED))
        near = _NEAR * self._grip
        return near if gripper is None else max(near, (gripper.stroke - width) / 2)

    def _pick(self, pick: _Place, down: FloatArray, room: float) -> list[ScriptPhase]:
        """Go above the cube, down until it is between the fingers, close them, lift."""
        cube, base, scale, grip = pick.thing, self._stand(pick), self._scale, self._grip
        stage = np.array([pick.edge - 0.15 * scale, cube[1], cube[2] + 0.30 * scale])
        grasp = _above(cube, round(tips_beyond_tool(self._model) - _BELOW * grip, 6))
        near = _NEAR * grip

        def phase(name: str, position: FloatArray, **options: float) -> ScriptPhase:
            return ScriptPhase(Pose(position, down), base, name=name, **options)  # type: ignore[arg-type]

        return [
            phase("stage", stage, distance=0.10 * scale, angle=0.30),
            phase("above", _above(cube, 0.14 * grip), distance=0.02 * grip, angle=0.10),
            phase("descend", grasp, distance=near, beside=room, angle=_ALIGNED, pace=0.4, patience=8.0),
            phase("grasp", grasp, distance=1.0, angle=3.2, gripper=1.0, dwell=1.2),
            phase("lift", _above(cube, 0.22 * grip), distance=0.04 * grip, angle=0.3, gripper=1.0, pace=0.6),
        ]

    def _carry(self, pick: _Place, place: _Place, down: FloatArray) -> list[ScriptPhase]:
        """Pull back until the base is behind the floor obstacles, cross, and go up to the other table."""
        scale = self._scale
        height = max(pick.thing[2], place.thing[2]) + 0.30 * scale
        lane, ahead = self._route.lane, _AHEAD * scale
        hand_lane = lane + ahead

        def phase(name: str, x: float, at: _Place, base: FloatArray) -> ScriptPhase:
            hand = Pose(np.array([x, at.thing[1], height]), down)
            return ScriptPhase(hand, base, name=name, gripper=1.0, distance=0.12 * scale, angle=0.4)

        if self._drives:
            retreat = phase("retreat", self._stand(pick)[0] + ahead, pick, self._stand(pick))
            front = phase("front", self._stand(place)[0] + ahead, place, self._stand(place))
            return [retreat, *self._route.drive(self._stand(pick), self._stand(place), front.hand, 1.0)]
        return [
            phase("retreat", hand_lane, pick, np.array([lane, pick.thing[1], 0.0])),
            phase("cross", hand_lane, place, np.array([lane, place.thing[1], 0.0])),
            phase("front", place.edge - _RETREAT * scale, place, self._stand(place)),
        ]

    def _place(self, place: _Place, down: FloatArray, height: float) -> list[ScriptPhase]:
        rim = _above(place.thing, height)
        base, grip = self._stand(place), self._grip

        def phase(name: str, rise: float, **options: float) -> ScriptPhase:
            return ScriptPhase(Pose(_above(rim, rise), down), base, name=name, **options)  # type: ignore[arg-type]

        return [
            phase("over", 0.18 * grip, gripper=1.0, distance=0.03 * grip, angle=0.3),
            phase("lower", 0.045 * grip, gripper=1.0, distance=0.025 * grip, angle=0.3, pace=0.4),
            phase("release", 0.045 * grip, distance=1.0, angle=3.2, dwell=0.8),
            phase("rise", 0.25 * grip, distance=0.05 * grip, angle=0.5),
        ]

    def _stand(self, place: _Place) -> FloatArray:
        return self._route.stand(place.thing, place.edge)


def _above(position: FloatArray, height: float) -> FloatArray:
    return position + np.array([0.0, 0.0, height])


def tips_beyond_tool(model: RobotModel) -> float:
    """Return how far the finger tips are beyond the tool point [m]; 0 of a robot without fingers."""
    gripper, home = model.description.end_effector.gripper, model.description.home
    if gripper is None:
        return 0.0
    frame, tool = model.pose(home, gripper.frame), model.pose(home)
    offset = gripper.placement.translation[2] + gripper.tip
    return float(offset - frame.rotation[:, 2] @ (tool.position - frame.position))
