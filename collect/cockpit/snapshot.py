"""What the page shows of a moment: one small value, many times a second."""

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from handrail.collect.cockpit import stage
from handrail.collect.cockpit.lead import Lead, Leads
from handrail.collect.cockpit.nearest import NearestPair
from handrail.collect.cockpit.reasons import reason
from handrail.collect.envs.env import HandrailEnv
from handrail.collect.operators.operator import View
from handrail.collect.operators.person.person import Person, Phase
from handrail.collect.session.outcome import Outcome
from handrail.collect.tasks.task import Aimed, TaskState
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.trajectory import Trajectory
from handrail.controllers.numerics.rotation import quaternion_from_matrix
from handrail.controllers.robot.model import Pose
from handrail.datasets.recording.frames import Frame

_PATH_STEPS = 8  # of a plan that is drawn


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
        base = len(self._model.description.base_joints)
        return {
            "path": [np.round(self._model.pose(each).position, 3).tolist() for each in chosen],
            "track": np.round(chosen[:, :base], 3).tolist() if base else [],
        }


def _numbers(pose: Pose) -> list[float]:
    """Return a position [m] and quaternion (wxyz), (7,)."""
    turn = quaternion_from_matrix(pose.rotation)
    return np.round(np.concatenate([pose.position, turn]), 4).tolist()
