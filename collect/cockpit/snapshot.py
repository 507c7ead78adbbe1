"""What the page shows of a moment: one small value, many times a second."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from handrail.collect.cockpit import stage
from handrail.collect.cockpit.nearest import NearestPair
from handrail.collect.operators.operator import View
from handrail.collect.operators.person.person import Person, Phase
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.task import TaskState
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.intent import Intent
from handrail.controllers.numerics.rotation import quaternion_from_matrix, turned
from handrail.controllers.robot.description import RobotDescription
from handrail.controllers.robot.model import Pose, RobotModel
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
AHEAD = 0.6  # how far the ghosts of the page are ahead of the robot [s]
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


def hands_ahead(
    model: RobotModel, intent: Intent, tools: Sequence[Pose], q: FloatArray
) -> tuple[Pose | None, ...]:
    """Return each hand's pose within `AHEAD`, at the velocity that is asked for; None where none is."""
    channels, asked = Channels.of(model.description), _asked(intent)
    pair, joints = asked[channels.pair_slice], asked[channels.joint_slice]
    if pair.any():
        return _pair_ahead(pair, tools, intent.frames.tool == "tool")
    moved, found = joints[len(channels.base) :].any(), list[Pose | None]()
    for number, (hand, tool) in enumerate(zip(model.description.hands, tools, strict=True)):
        twist = asked[channels.hand_slice(number)]
        if twist.any():
            axes = tool.rotation if intent.frames.tool == "tool" else np.eye(3)
            found.append(_moved(tool, axes @ twist[:3], axes @ twist[3:], tool.position))
        else:
            found.append(model.pose(q + AHEAD * joints, hand.named("tool")) if moved else None)
    return tuple(found)


def _pair_ahead(pair: FloatArray, tools: Sequence[Pose], in_tool: bool) -> tuple[Pose, ...]:
    """Return the poses of two hands that move as one body about the middle between them, and part."""
    axes = tools[0].rotation if in_tool else np.eye(3)
    way = tools[1].position - tools[0].position
    parting = 0.5 * pair[6] * way / max(float(np.linalg.norm(way)), 1e-9)
    middle, linear, angular = tools[0].position + 0.5 * way, axes @ pair[:3], axes @ pair[3:6]
    one, other = tools
    return (
        _moved(one, linear - parting, angular, middle),
        _moved(other, linear + parting, angular, middle),
    )


def _moved(tool: Pose, linear: FloatArray, angular: FloatArray, about: FloatArray) -> Pose:
    """Return a pose within `AHEAD` that goes along, and turns about a point."""
    turn = Rotation.from_rotvec(AHEAD * angular).as_matrix()
    return Pose(about + turn @ (tool.position - about) + AHEAD * linear, turn @ tool.rotation)


def base_ahead(model: RobotModel, intent: Intent, q: FloatArray) -> FloatArray | None:
    """Return the base's x, y [m] and yaw [rad] in the world, (3,), within `AHEAD`; None likewise."""
    channels, asked = Channels.of(model.description), _asked(intent)
    base = slice(0, len(channels.base))
    twist, joints = asked[channels.base_slice], asked[channels.joint_slice][base]
    if twist.any():
        return q[base] + AHEAD * turned(twist, q[2] + 0.5 * AHEAD * twist[2])
    return q[base] + AHEAD * joints if joints.any() else None


def _asked(intent: Intent) -> FloatArray:
    return np.where(intent.mask, np.nan_to_num(intent.values), 0.0)


class Snapshots:
    """Puts together what the page shows of an environment in which an episode has begun."""

    def __init__(self, env: HandrailEnv) -> None:
        self._env, self._model = env, env.model
        self._nearest = NearestPair(env.simulation.mujoco_model)
        self._frame: Frame | None = None
        self._undo_to = 0.0  # the moment that an undo goes back to [s]

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
        if person.phase is not Phase.DRIVING and not np.any(state.commanded):
            self._undo_to = state.time
        return {
            "stamp": round(stamp, 4),
            "time": round(state.time, 3),
            "practice": person.practises,
            "aim": self._aim(view.task),
            "judge": None if env.real else env.task.outcome(view.task).success,
            "undo_takes": round(state.time - self._undo_to, 1),
            "left": round(env.task.horizon - state.time, 1),
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

    def _controlled(self, view: View) -> dict[str, Any]:
        """Return how the controller fares, and where intent and plan lead.

        The ghosts are each hand's pose, (7,), and the base's x, y, yaw, empty at rest; the plan is the path
        of each hand, (k, 3), and the track of the base's x, y, yaw, (k, 3) [m, rad].
        """
        frame, model, q = self._frame, self._model, view.state.q
        shown: dict[str, Any] = {"undos": 0, "status": "ok", "reason": ""}
        shown |= {"ghosts": [], "ghost_base": [], "paths": [], "track": []}
        if frame is None:
            return shown
        status = frame.diagnostics.status
        shown["undos"], shown["status"] = frame.undos, status.value
        shown["reason"] = reason(status, self._env.plant.contacts, q, model.description)
        hands = hands_ahead(model, frame.intent, view.task.tools, q)
        shown["ghosts"] = [_numbers(hand) if hand else [] for hand in hands]
        if (base := base_ahead(model, frame.intent, q)) is not None:
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
