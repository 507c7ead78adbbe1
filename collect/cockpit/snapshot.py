"""The state that the page shows: one small value, many times a second."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from handrail.collect.cockpit import stage
from handrail.collect.cockpit.ahead import base_ahead, hands_ahead
from handrail.collect.cockpit.drivers import drivers, of_person
from handrail.collect.cockpit.nearest import NearestPair
from handrail.collect.operators.operator import View
from handrail.collect.operators.person.person import Person, Phase
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.task import TaskState
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.command import Status
from handrail.controllers.numerics.rotation import quaternion_from_matrix
from handrail.controllers.robot.description import RobotDescription
from handrail.controllers.robot.model import Pose
from handrail.datasets.recording.frames import Frame

STATUS: Mapping[Status, str] = {
    Status.OK: "",
    Status.CLIPPED: "limited: faster than the robot may",
    Status.INVALID_STATE: "braking: the robot's state makes no sense",
    Status.INVALID_INTENT: "braking: the command makes no sense",
    Status.INVALID_SCENE: "braking: the list of things around the robot makes no sense",
    Status.STALE_INTENT: "braking: no command",
    Status.SOLVER_FAILED: "braking: no plan was found",
    Status.BACKUP: "braking: no safe way on",
}
_PATH_STEPS = 8  # of a plan that is drawn
_CLOSE = 0.02  # to a limit [rad, m]
_MOST = 2  # contacts, and joints, that are named


def reason(status: Status, contacts: Iterable[str], q: FloatArray, robot: RobotDescription) -> str:
    """Return what is in the way, the gravest first; empty where nothing is.

    Args:
        status: of the controller.
        contacts: forbidden ones, as pairs of names.
        q: of the robot, (n,) [m, rad].
        robot: its description.
    """
    limits, base = robot.limits, len(robot.base.joints)
    at = np.flatnonzero((q < limits.position_lower + _CLOSE) | (q > limits.position_upper - _CLOSE))
    joints = ["base at the edge of its area"] if np.any(at < base) else []
    joints += [f"joint {robot.joints[n].removesuffix('_joint')} at its limit" for n in at if n >= base]
    touching = [f"touching: {pair}" for pair in list(contacts)[:_MOST]]
    found = [each.replace("_", " ") for each in (*touching, *joints[:_MOST])]
    return " · ".join(filter(None, [STATUS[status], *found]))


class Snapshots:
    """Puts together what the page shows of an environment in which an episode has begun.

    Args:
        env: of the episode.
        shared: whether a policy drives beside the person; then it also says who drives what.
    """

    def __init__(self, env: HandrailEnv, shared: bool = False) -> None:
        self._shared = shared
        self._env, self._model = env, env.model
        self._nearest = NearestPair(env.simulation.mujoco_model)
        self._frame: Frame | None = None
        self._undo_to = self._time = 0.0  # the moment that an undo goes back to, and the last one [s]
        self._undos, self._rests = 0, False  # whether the robot has come to rest, and has not gone on yet

    def see(self, frame: Frame) -> None:
        """Take how the controller fared."""
        self._frame = frame

    def now(self, view: View, person: Person, stamp: float) -> dict[str, Any]:
        """Return the moment.

        Args:
            view: what the operator sees.
            person: whoever steers.
            stamp: of the clock of inputs [s].
        """
        setting, env, state = person.setting, self._env, view.state
        if state.time < self._time:  # after an undo: what the frame shows has never been
            self._frame, self._undos = None, self._undos + 1
        self._time = state.time
        if person.phase is not Phase.DRIVING:
            self._rests |= not np.any(state.commanded)
        elif self._rests:
            self._undo_to, self._rests = state.time, False
        return {
            "stamp": round(stamp, 4),
            "time": round(state.time, 3),
            "practice": person.practises,
            "aim": self._aim(view.task),
            "judge": None if env.real else env.task.outcome(view.task).success,
            "undo_takes": 0.0 if env.real else round(state.time - self._undo_to, 1),
            "left": round(env.task.time_limit - state.time, 1),
            "phase": person.phase.value,
            "poses": stage.poses(env.simulation.data),
            "hand": person.meaning.hands.index(setting.hand),
            "tools": [_numbers(tool) for tool in view.task.tools],
            "openings": np.round(view.task.openings, 2).tolist(),
            "mode": setting.mode.name,
            "focus": setting.focus if setting.mode.by_focus else "",
            "frame": setting.frame,
            "speed": setting.speed,
            "locked": setting.locked,
            "mask": np.flatnonzero(person.meaning.mask(setting)).tolist(),
            "nearest": self._nearest.find(env.simulation.data),
            "q": np.round(state.q, 3).tolist(),
            "v": np.round(state.commanded, 3).tolist(),
            **self._controlled(view),
            **self._drivers(view, person),
            "age": round(min(person.age, 99.0), 3),
            "round_trip": round(person.round_trip, 4),
        }

    def _aim(self, state: TaskState) -> dict[str, Any] | None:
        """Return where the hand is to be brought, if the task says that."""
        aim = self._env.task.aim(state)
        if aim is None:
            return None
        turn = [] if aim.rotation is None else quaternion_from_matrix(aim.rotation)
        pose = np.round(np.concatenate([aim.position, turn]), 4).tolist()
        said = {"name": aim.name, "pose": pose, "distance": aim.distance, "angle": round(aim.angle, 4)}
        return said | {"hand": state.hand}

    def _drivers(self, view: View, person: Person) -> dict[str, Any]:
        """Return who drives what, where a policy can; nobody while the robot brakes for want of a command."""
        if not self._shared:
            return {}
        frame, drives = self._frame, person.phase is Phase.DRIVING
        moves = frame is not None and frame.diagnostics.status is not Status.STALE_INTENT
        asked = frame.intent if frame and drives and moves else None
        return {"drivers": drivers(asked, self._model, view.task.tools, view.state.q)}

    def _controlled(self, view: View) -> dict[str, Any]:
        """Return how the controller fares, and where intent and plan lead.

        The ghosts are each hand's pose, (7,), and the base's x, y, yaw, empty at rest; the plan is the path
        of each hand, (k, 3), and the track of the base's x, y, yaw, (k, 3) [m, rad].
        """
        frame, model, q = self._frame, self._model, view.state.q
        shown: dict[str, Any] = {"undos": self._undos, "status": "ok", "reason": ""}
        shown |= {"ghosts": [], "ghost_base": [], "paths": [], "track": []}
        if frame is None:
            return shown
        shown["status"] = (status := frame.diagnostics.status).value
        shown["reason"] = reason(status, self._env.plant.contacts, q, model.description)
        asked = of_person(frame.intent)
        hands = hands_ahead(model, asked, view.task.tools, q)
        shown["ghosts"] = [_numbers(hand) if hand else [] for hand in hands]
        if (base := base_ahead(model, asked, q)) is not None:
            shown["ghost_base"] = np.round(base, 3).tolist()
        if frame.plan is not None:
            path, _ = frame.plan.path(q)
            chosen = path[:: max(1, len(path) // _PATH_STEPS)]
            shown["paths"] = [
                [np.round(model.pose(each, hand.named("tool")).position, 3).tolist() for each in chosen]
                for hand in model.description.hands
            ]
            joints = len(model.description.base.joints)
            shown["track"] = np.round(chosen[:, :joints], 3).tolist() if joints else []
        return shown


def _numbers(pose: Pose) -> list[float]:
    """Return a position [m] and quaternion (wxyz), (7,)."""
    turn = quaternion_from_matrix(pose.rotation)
    return np.round(np.concatenate([pose.position, turn]), 4).tolist()
