"""The masked model predictive controller: the operator steers a part, the optimum completes the rest."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.channels import Channels
from handrail.controllers.collision import CollisionModel
from handrail.controllers.command import Command, Health, Status
from handrail.controllers.controller import State
from handrail.controllers.guard import check_inputs
from handrail.controllers.intent import Intent
from handrail.controllers.limiter import Limiter
from handrail.controllers.model import RobotModel
from handrail.controllers.objective import (
    Objective,
    StageResiduals,
    acceleration_regularisation,
    posture,
    tracking,
    velocity_regularisation,
)
from handrail.controllers.problem import Plan, Problem
from handrail.controllers.real_time import RealTimeSolver
from handrail.controllers.shape import Obstacle

_LARGEST_INTENT = 10.0  # [m/s, rad/s]; beyond any robot's limits, and keeps the QP well scaled

Prediction = Callable[[Intent, int], FloatArray]
"""Ψ: the intent and a number of stages N → predicted values on every channel, (N, m)."""


def constant_prediction(intent: Intent, horizon: int) -> FloatArray:
    """Hold the command over the horizon (the paper's choice), (N, m)."""
    return np.tile(intent.values, (horizon, 1))


@dataclass(frozen=True)
class MpcSettings:
    """Settings of the masked MPC; weights are per squared unit of their residual.

    Attributes:
        horizon: stages N.
        dt: length of a stage [s].
        decay: γ; stage k tracks the intent with weight γᵏ.
        tracking: weight of the commanded channels.
        base_velocity: weight of base velocities that nobody commands.
        arm_velocity: weight of arm velocities that nobody commands.
        acceleration: weight of all accelerations.
        posture: weight that draws the arm to its home posture while the tool is steered.
        margin: signed distance kept between shapes [m].
        work_margin: the same between tool shapes and work surfaces [m].
        reach: distance beyond the margin at which a pair enters the problem [m].
        slack_linear: linear penalty of the slack.
        slack_quadratic: quadratic penalty of the slack.
        intent_timeout: age from which an intent is stale [s].
        velocity_tolerance: how far the measured velocity may be from the commanded one before the plan
            starts from the measured one, relative to the velocity limit.
    """

    horizon: int = 10
    dt: float = 0.1
    decay: float = 0.9
    tracking: float = 1000.0
    base_velocity: float = 0.01
    arm_velocity: float = 0.1
    acceleration: float = 0.01
    posture: float = 0.05
    margin: float = 0.10
    work_margin: float = 0.008
    reach: float = 0.30
    slack_linear: float = 1e5
    slack_quadratic: float = 1e5
    intent_timeout: float = 0.25
    velocity_tolerance: float = 0.1


@dataclass
class _Memory:
    """What is carried from one update to the next."""

    plan: Plan | None = None
    time: float = 0.0
    command: Command | None = None


@dataclass(frozen=True)
class _Setup:
    """What is built once a robot."""

    model: RobotModel
    settings: MpcSettings
    channels: Channels
    residuals: StageResiduals
    solver: RealTimeSolver
    limiter: Limiter
    predict: Prediction = field(default=constant_prediction)


class MaskedMpc:
    """Masked MPC of the paper's equation (6); a controller.

    Args:
        model: of the robot.
        settings: weights, margins, horizon.
        objectives: autonomous objectives besides the built-in ones.
        predict: intent prediction Ψ.
    """

    def __init__(
        self,
        model: RobotModel,
        settings: MpcSettings = MpcSettings(),
        objectives: tuple[Objective, ...] = (),
        predict: Prediction = constant_prediction,
    ) -> None:
        channels = Channels.of(model.description)
        built_in = built_in_objectives(model, channels, settings)
        residuals = StageResiduals(model, (*built_in, *objectives), settings.horizon)
        solver = RealTimeSolver(residuals, settings.horizon, model.size, settings.dt)
        limiter = Limiter(model.description)
        self._setup = _Setup(model, settings, channels, residuals, solver, limiter, predict)
        self._discounts = settings.decay ** np.arange(settings.horizon)
        self.reset()

    @property
    def channels(self) -> Channels:
        """The robot's command channels."""
        return self._setup.channels

    @property
    def plan(self) -> Plan | None:
        """The plan of the last update; None after a brake."""
        return self._memory.plan

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget warm start and last command; take the obstacles of a new episode."""
        settings = self._setup.settings
        self._collision = CollisionModel(self._setup.model, obstacles)
        wanted = np.where(self._collision.work, settings.work_margin, settings.margin)
        self._margins = np.minimum(wanted, self._collision.largest_margin)
        self._memory = _Memory()

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from now on; brakes when an input is invalid or stale, or the solver fails."""
        start = perf_counter()
        setup = self._setup
        status = check_inputs(state, intent, setup.channels, setup.settings.intent_timeout)
        plan = None
        if status is Status.OK:
            problem = self.problem(state, intent)
            plan = setup.solver.solve(problem, self._guess(state.time))
            if not plan.is_solution(problem):
                status, plan = Status.SOLVER_FAILED, None
        health = self._health(state, status, plan)
        velocities = self._brake(state, status) if plan is None else plan.v
        gripper = intent.gripper if np.isfinite(intent.gripper) else self._last_gripper()
        command = Command(velocities, setup.settings.dt, float(np.clip(gripper, 0.0, 1.0)), health)
        time = state.time if np.isfinite(state.time) else self._memory.time
        self._memory = _Memory(plan, time, command)
        return replace(command, health=replace(health, solve_time=perf_counter() - start))

    def problem(self, state: State, intent: Intent) -> Problem:
        """Return the optimal control problem of a state and an intent."""
        setup, settings = self._setup, self._setup.settings
        predicted = np.where(intent.mask, setup.predict(intent, settings.horizon), 0.0)
        predicted = np.clip(predicted, -_LARGEST_INTENT, _LARGEST_INTENT)
        reference = np.tile(setup.residuals.reference, (settings.horizon, 1))
        reference[:, : setup.channels.size] = predicted
        weights = np.tile(setup.residuals.weights(np.asarray(intent.mask)), (settings.horizon, 1))
        weights[:, : setup.channels.size] *= self._discounts[:, None]
        return Problem(
            q=state.q,
            v=self._start_velocity(state),
            dt=settings.dt,
            reference=reference,
            weights=weights,
            limits=setup.model.description.limits,
            collision=self._collision,
            margins=self._margins,
            reach=settings.reach,
            slack_linear=settings.slack_linear,
            slack_quadratic=settings.slack_quadratic,
        )

    def _start_velocity(self, state: State) -> FloatArray:
        """Return the velocity that the plan starts from: the commanded one, if the robot follows it."""
        command = self._memory.command
        if command is None:
            return state.v
        tolerance = self._setup.settings.velocity_tolerance * self._setup.model.description.limits.velocity
        commanded = command.velocity(state.time - self._memory.time)
        return np.clip(commanded, state.v - tolerance, state.v + tolerance)

    def _guess(self, time: float) -> FloatArray:
        """Return the last plan's accelerations, shifted by the time that has passed, (N, n)."""
        settings = self._setup.settings
        plan = self._memory.plan
        if plan is None:
            return np.zeros((settings.horizon, self._setup.model.size))
        shift = max(time - self._memory.time, 0.0) / settings.dt
        padded = np.vstack([plan.u, np.zeros((1, plan.u.shape[1]))])
        stages = np.minimum(np.arange(settings.horizon) + shift, settings.horizon)
        lower = np.floor(stages).astype(int)
        upper = np.minimum(lower + 1, settings.horizon)
        weight = (stages - lower)[:, None]
        return (1.0 - weight) * padded[lower] + weight * padded[upper]

    def _brake(self, state: State, status: Status) -> FloatArray:
        settings = self._setup.settings
        trusted = status is not Status.INVALID_STATE
        velocity = self._start_velocity(state) if trusted else self._last_velocity(state.time)
        return self._setup.limiter.brake(velocity, settings.dt, settings.horizon)

    def _last_velocity(self, time: float) -> FloatArray:
        """Return what is commanded at a time, which may be no number, (n,)."""
        command = self._memory.command
        if command is None:
            return np.zeros(self._setup.model.size)
        elapsed = time - self._memory.time
        return command.velocity(elapsed) if np.isfinite(elapsed) else command.velocities[1]

    def _last_gripper(self) -> float:
        return 0.0 if self._memory.command is None else self._memory.command.gripper

    def _health(self, state: State, status: Status, plan: Plan | None) -> Health:
        if plan is not None:
            distances = plan.distances
        elif state.is_finite and state.q.shape == (self._setup.model.size,):
            distances = self._collision.distances(state.q[None, :], reach=-np.inf).values[0]
        else:
            return Health(status)
        work = self._collision.work
        return Health(
            status=status,
            slack=0.0 if plan is None else max(plan.collision_slack, plan.limit_slack),
            smallest_distance=float(np.min(distances[~work], initial=np.inf)),
            work_distance=float(np.min(distances[work], initial=np.inf)),
        )


def built_in_objectives(
    model: RobotModel, channels: Channels, settings: MpcSettings
) -> tuple[Objective, ...]:
    """Return the objectives of the paper's stage cost: tracking first, then the regularisation."""
    base = len(model.description.base_joints)
    arm = np.arange(model.size) >= base
    velocity = np.where(arm, settings.arm_velocity, settings.base_velocity)
    return (
        tracking(channels, np.full(channels.size, settings.tracking)),
        velocity_regularisation(channels, velocity),
        acceleration_regularisation(np.full(model.size, settings.acceleration)),
        posture(channels, model.description.home, settings.posture * arm),
    )
