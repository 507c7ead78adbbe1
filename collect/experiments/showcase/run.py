"""Runs a case through the one session loop, and keeps what happened."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from handrail.collect.envs.env import HandrailEnv
from handrail.collect.experiments.showcase.cases import Case
from handrail.collect.operators.operator import View
from handrail.collect.session.outcome import Outcome
from handrail.collect.session.session import Observer, Session
from handrail.collect.tasks.task import Start, TaskState, Verdict
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.channel_matrix import channel_matrix
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.prediction import Extrapolated
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.objectives.hold import end_effector_hold, hold_parameters
from handrail.controllers.objectives.switch import switchable, switched
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Obstacle
from handrail.datasets.recording.frames import Frame

FPS = 20
_WINDOW, _FADE = 0.2, 1.0  # of the intent's prediction [s]
_HOLD = 20.0  # weight of the hand's position in case C [1/m²]


@dataclass(frozen=True)
class Trace:
    """What happened, after each of the T control periods.

    Attributes:
        case: which.
        times: [s], (T,).
        q: positions, (T, n).
        asked: what the operator asks for at these times on the commanded channels, (T, c).
        realised: measured on these channels, (T, c).
        hand: position of the tool [m], (T, 3).
        pairs: names of the pairs that keep apart, (P,).
        own_margin: which of them keep a smaller margin than the controller's, (P,).
        distances: signed [m], (T, P).
        solve_times: of the updates [s], (T,).
        outcome: of the session.
    """

    case: Case
    times: FloatArray
    q: FloatArray
    asked: FloatArray
    realised: FloatArray
    hand: FloatArray
    pairs: tuple[tuple[str, str], ...]
    own_margin: BoolArray
    distances: FloatArray
    solve_times: FloatArray
    outcome: Outcome


def build_controller(model: RobotModel) -> MaskedMpc:
    """Return the one controller of all cases: the masked MPC with a hold that can be switched on."""
    hold = end_effector_hold(Channels.of(model.description), position=_HOLD)
    settings = MpcSettings(posture=0.0)  # no posture to return to
    return MaskedMpc(model, settings, objectives=(switchable(hold),), predict=Extrapolated(_WINDOW, _FADE))


def parameters(case: Case) -> Mapping[str, FloatArray]:
    """Return the parameters of the objectives in a case, by objective."""
    point = np.array(case.held) if case.held else np.zeros(3)
    return {"hold": switched(hold_parameters(Pose(point, np.eye(3))), bool(case.held))}


def run_case(case: Case, env: HandrailEnv, mpc: MaskedMpc, observers: tuple[Observer, ...] = ()) -> Trace:
    """Run a case in an environment of its `ShowcaseTask` and return what happened."""
    operator, tracer = CaseOperator(case, env.model), _Tracer(case, mpc)
    session = Session(env, Parametrised(mpc, parameters(case)), operator, (tracer, *observers))
    return tracer.trace(session.run(seed=0))


@dataclass(frozen=True)
class ShowcaseTask:
    """A task without a goal: the case's beginning, over after its time."""

    case: Case
    state_names: tuple[str, ...] = ()

    @property
    def description(self) -> str:
        """What is shown."""
        return self.case.title

    @property
    def horizon(self) -> float:
        """Time limit, never reached [s]."""
        return self.case.seconds + 1.0

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Return the beginning, always the same."""
        return Start(self.case.scene, self.case.q)

    def features(self, state: TaskState) -> FloatArray:
        """Return no features, (0,)."""
        return np.zeros(0)

    def outcome(self, state: TaskState) -> Verdict:
        """Say whether the time is over."""
        return Verdict(state.time > self.case.seconds - 0.5 / FPS)


class CaseOperator:
    """Commands what the case says."""

    def __init__(self, case: Case, model: RobotModel) -> None:
        self._case = case
        channels = Channels.of(model.description)
        self._mask = channels.mask(*case.channels)
        self._index = [channels.names.index(name) for name in case.channels]

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin."""

    def act(self, view: View) -> Intent:
        """Return the intent now."""
        time, case = view.state.time, self._case
        values = np.zeros(len(self._mask))
        values[self._index] = case.command(time, case.seconds)
        return Intent(values, self._mask, mode=f"case {case.name}", time=time, frames=case.frames)


class Parametrised:
    """A masked MPC whose objectives get their parameters at the beginning of every episode; a controller."""

    def __init__(self, mpc: MaskedMpc, values: Mapping[str, FloatArray]) -> None:
        self._mpc = mpc
        self._values = values

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Reset the controller, then set the parameters."""
        self._mpc.reset(obstacles)
        for objective, values in self._values.items():
            self._mpc.set_parameters(objective, values)

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Tell the controller where the obstacles are, and what the hand holds."""
        self._mpc.update_scene(obstacles)

    def update(self, state: State, intent: Intent) -> Command:
        """Return the controller's command."""
        return self._mpc.update(state, intent)


class _Tracer:
    """Notes what is asked and what happens; an observer."""

    def __init__(self, case: Case, mpc: MaskedMpc) -> None:
        self._case = case
        self._channels = mpc.channels
        self._margin = mpc.settings.margin
        self._index = [mpc.channels.names.index(name) for name in case.channels]
        self._rows: list[tuple[State, float]] = []

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note of the scene."""
        self._env = env

    def see(self, frame: Frame) -> None:
        """Note the state after the period."""
        self._rows.append((self._env.state(), frame.diagnostics.solve_time))

    def trace(self, outcome: Outcome) -> Trace:
        """Return what was seen."""
        states, solve_times = zip(*self._rows, strict=True)
        model, case = self._env.model, self._case
        q = np.array([state.q for state in states])
        collision = CollisionModel(model, self._env.start.scene.obstacles())
        return Trace(
            case=case,
            times=np.array([state.time for state in states]),
            q=q,
            asked=np.array([case.command(state.time, case.seconds) for state in states]),
            realised=np.array([self._realised(state) for state in states]),
            hand=np.array([model.pose(row).position for row in q]),
            pairs=collision.pairs,
            own_margin=collision.largest_margin < self._margin,
            distances=collision.values(q),
            solve_times=np.array(solve_times),
            outcome=outcome,
        )

    def _realised(self, state: State) -> FloatArray:
        velocity = channel_matrix(self._env.model, self._channels, state.q) @ state.v
        if self._case.frames.base == "world":
            velocity[:3] = state.v[:3]
        return velocity[self._index]
