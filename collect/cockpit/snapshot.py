"""What the page shows of a moment: one small value, many times a second."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from handrail.collect.cockpit import stage
from handrail.collect.cockpit.lead import Lead, Leads
from handrail.collect.operators.operator import View
from handrail.collect.operators.person.person import Person, Phase
from handrail.collect.session.outcome import Outcome
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.geometry import ROBOT_BIT
from handrail.collect.world.gl import MjData, MjModel, mujoco
from handrail.collect.world.task import Aimed, TaskState
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.trajectory import Trajectory
from handrail.controllers.numerics.rotation import quaternion_from_matrix
from handrail.controllers.robot.description import RobotDescription
from handrail.controllers.robot.model import Pose
from handrail.datasets.recording.frames import Frame

_PATH_STEPS = 8  # of a plan that is drawn


_FAR = 0.5  # farther is not looked for [m]


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
_CLOSE = 0.02  # to a limit [rad, m]
_MOST = 2  # contacts, and joints, that are named


def reason(status: Status, contacts: Iterable[str], q: FloatArray, robot: RobotDescription) -> str:
    """Return what is in the way, the gravest first; empty where nothing is.

    Args:
        status: of the controller.
        contacts: forbidden ones, as pairs of names.
        q: of the robot, (n,) [m, rad].
        robot: it.
    """
    touching = [f"touching: {_plain(pair)}" for pair in list(contacts)[:_MOST]]
    return " · ".join(filter(None, [STATUS[status], *touching, *_at_limits(q, robot)[:_MOST]]))


def _at_limits(q: FloatArray, robot: RobotDescription) -> list[str]:
    limits, base = robot.limits, len(robot.base.joints)
    at = np.flatnonzero((q < limits.position_lower + _CLOSE) | (q > limits.position_upper - _CLOSE))
    names = [_plain(robot.joints[index].removesuffix("_joint")) for index in at if index >= base]
    edge = ["base at the edge of its area"] if np.any(at < base) else []
    return edge + [f"joint {name} at its limit" for name in names]


def _plain(name: str) -> str:
    return name.replace("_", " ")


@dataclass(frozen=True)
class Nearest:
    """Two points, one on each, (2, 3), how far apart their surfaces are [m], and of what they are."""

    points: tuple[float, ...]
    distance: float
    names: tuple[str, str]


class NearestPair:
    """Measures the robot against itself and what stands around; what it may carry or pull is left out.

    Args:
        model: the compiled model.
    """

    def __init__(self, model: MjModel) -> None:
        self._model = model
        robot = [g for g in range(model.ngeom) if model.geom_contype[g] & ROBOT_BIT]
        solid = np.flatnonzero((model.geom_contype | model.geom_conaffinity) > 0).tolist()
        scene = [g for g in solid if g not in robot and model.geom_bodyid[g] and self._is_apart(g, robot)]
        own = zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)
        pairs = [*own, *((first, second) for first in robot for second in scene)]
        self._first, self._second = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
        self._radii = model.geom_rbound[self._first] + model.geom_rbound[self._second]

    def _is_apart(self, geom: int, robot: list[int]) -> bool:
        """Whether a geom is no part of the robot, as a finger is, and nothing that can be moved."""
        if self._model.body_dofnum[self._model.geom_bodyid[geom]]:
            return False
        bodies = {int(self._model.body_rootid[self._model.geom_bodyid[each]]) for each in robot}
        return int(self._model.body_rootid[self._model.geom_bodyid[geom]]) not in bodies

    def find(self, data: MjData) -> Nearest | None:
        """Return the nearest pair now; None where nothing is near.

        Pairs are looked at in the order of their bounding spheres' distances, until no other can be nearer.
        """
        between = data.geom_xpos[self._first] - data.geom_xpos[self._second]
        bounds = np.sqrt(np.einsum("ij,ij->i", between, between)) - self._radii
        best, line, found = _FAR, np.zeros(6), None
        for index in np.argsort(bounds).tolist():
            if bounds[index] >= best:
                break
            first, second = int(self._first[index]), int(self._second[index])
            distance = mujoco.mj_geomDistance(self._model, data, first, second, best, line)
            if distance < best:
                best, found = distance, (first, second, tuple(np.round(line, 3).tolist()))
        if found is None:
            return None
        first, second, points = found
        return Nearest(points, round(best, 4), (self._name(first), self._name(second)))

    def _name(self, geom: int) -> str:
        name = self._model.geom(geom).name or self._model.body(self._model.geom_bodyid[geom]).name
        return name.replace("_", " ")


@dataclass
class Counts:
    """What has been recorded in this run."""

    saved: int = 0
    succeeded: int = 0
    episodes: list[dict[str, Any]] = field(default_factory=list)

    def add(self, outcome: Outcome, played: str = "") -> None:
        """Count an episode.

        Args:
            outcome: of it.
            played: the file of its poses, if it was kept.
        """
        self.saved += outcome.kept
        self.succeeded += outcome.kept and outcome.success
        words = "success" if outcome.success else outcome.failure_reason or str(outcome.ended_by)
        words += "; you said done" if outcome.operator_says == "success" and not outcome.success else ""
        words = f"practice: {words}" if outcome.practice else words
        said = {"kept": outcome.kept, "success": outcome.success, "said": words, "seconds": outcome.seconds}
        self.episodes.append(said | {"played": played})


class Snapshots:
    """Puts together what the page shows.

    Args:
        env: in which an episode has begun.
    """

    def __init__(self, env: HandrailEnv) -> None:
        self._env, self._model = env, env.model
        self._nearest = NearestPair(env.simulation.mujoco_model)
        self._leads = Leads(env.model)
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
        frame, setting = self._frame, person.setting
        mask = person.meaning.mask(setting)
        if person.phase is not Phase.DRIVING and not np.any(view.state.commanded):
            self._undo_to = view.state.time
        return {
            "stamp": round(stamp, 4),
            "time": round(view.state.time, 3),
            "practice": person.practises,
            "undos": frame.undos if frame else 0,
            "aim": self._aim(view.task),
            "judge": None if self._env.real else self._env.task.outcome(view.task).success,
            "undo_takes": round(view.state.time - self._undo_to, 1),
            "left": round(self._env.task.horizon - view.state.time, 1),
            "phase": person.phase.value,
            "poses": stage.poses(self._env.simulation.data),
            "tool": _numbers(view.tool),
            "opening": round(view.task.opening, 2),
            "mode": setting.mode.name,
            "focus": setting.focus if setting.mode.by_focus else "",
            "frame": setting.frame,
            "speed": setting.speed,
            "locked": setting.locked,
            "mask": np.flatnonzero(mask).tolist(),
            "status": frame.diagnostics.status.value if frame else "ok",
            "reason": self._reason(frame, view.state.q),
            "nearest": self._nearest_pair(),
            "q": np.round(view.state.q, 3).tolist(),
            "v": np.round(view.state.commanded, 3).tolist(),
            **self._ghosts(view, frame),
            **self._plan(frame, view.state.q),
            "age": round(min(person.age, 99.0), 3),
            "round_trip": round(person.round_trip, 4),
        }

    def _aim(self, state: TaskState) -> dict[str, Any] | None:
        """Return where the hand is to be brought, if the task says that."""
        if not isinstance(self._env.task, Aimed):
            return None
        aim = self._env.task.aim(state)
        turn = [] if aim.rotation is None else quaternion_from_matrix(aim.rotation)
        pose = np.round(np.concatenate([aim.position, turn]), 4).tolist()
        return {"name": aim.name, "pose": pose, "distance": aim.distance, "angle": round(aim.angle, 4)}

    def _reason(self, frame: Frame | None, q: FloatArray) -> str:
        if frame is None:
            return ""
        return reason(frame.diagnostics.status, self._env.world.contacts, q, self._model.description)

    def _nearest_pair(self) -> dict[str, Any] | None:
        found = self._nearest.find(self._env.simulation.data)
        return asdict(found) if found else None

    def _ghosts(self, view: View, frame: Frame | None) -> dict[str, list[float]]:
        """Return where the intent leads: the hand's pose, (7,), and the base's x, y, yaw; empty at rest."""
        lead = self._leads.find(frame.intent, view.tool, view.state.q) if frame else Lead()
        return {
            "ghost": _numbers(lead.hand) if lead.hand else [],
            "ghost_base": [] if lead.base is None else np.round(lead.base, 3).tolist(),
        }

    def _plan(self, frame: Frame | None, q: FloatArray) -> dict[str, list[list[float]]]:
        """Return where the plan leads: the hand, (k, 3), and the base's x, y, yaw, (k, 3) [m, rad]."""
        plan: Trajectory | None = frame.plan if frame else None
        if plan is None:
            return {"path": [], "track": []}
        path, _ = plan.path(q)
        chosen = path[:: max(1, len(path) // _PATH_STEPS)]
        base = len(self._model.description.base.joints)
        return {
            "path": [np.round(self._model.pose(each).position, 3).tolist() for each in chosen],
            "track": np.round(chosen[:, :base], 3).tolist() if base else [],
        }


def _numbers(pose: Pose) -> list[float]:
    """Return a position [m] and quaternion (wxyz), (7,)."""
    turn = quaternion_from_matrix(pose.rotation)
    return np.round(np.concatenate([pose.position, turn]), 4).tolist()
