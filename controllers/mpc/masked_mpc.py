"""The masked model predictive controller: the operator steers a part, the optimum completes the rest."""

from time import perf_counter

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.collision.distance_kernels import smallest_distances
from handrail.controllers.collision.margins import Margins
from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.errors import HandrailError, unknown_name
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Command, Diagnostics, Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.prediction import Prediction, constant
from handrail.controllers.interface.trajectory import Trajectory
from handrail.controllers.interface.validation import InputValidator
from handrail.controllers.mpc.last_command import Followed, following, sent_velocity
from handrail.controllers.objectives.objective import Objective
from handrail.controllers.objectives.regularisation import (
    acceleration_regularisation,
    posture,
    velocity_regularisation,
)
from handrail.controllers.objectives.tracking import tracking
from handrail.controllers.ocp.motion import cut, resumed
from handrail.controllers.ocp.problem import Plan, Problem
from handrail.controllers.ocp.residuals import StageResiduals
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle
from handrail.controllers.safety.backup import Backup, Situation
from handrail.controllers.safety.certificate import StopCertificate
from handrail.controllers.safety.limiter import Limiter
from handrail.controllers.solvers.real_time import RealTimeSolver

_SOLVER_ERRORS = (HandrailError, ArithmeticError, RuntimeError, ValueError)  # of ours, numpy, CasADi, coal
_UNHEARD = (Status.INVALID_STATE, Status.INVALID_SCENE, Status.INVALID_INTENT, Status.STALE_INTENT)


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
        settings: MpcSettings | None = None,
        objectives: tuple[Objective, ...] = (),
        predict: Prediction = constant,
    ) -> None:
        self.model = model
        self.settings = settings or MpcSettings()
        self.channels = Channels.of(model.description)
        built_in = built_in_objectives(model, self.channels, self.settings)
        horizon = self.settings.horizon
        self.residuals = StageResiduals(model, (*built_in, *objectives), horizon)
        self.solver = RealTimeSolver(self.residuals, horizon, model.size, self.settings.dt)
        self._limiter = Limiter(model.description)
        self._tolerance = self.settings.velocity_tolerance * model.description.limits.velocity
        self._predict = predict
        self._times = self.settings.dt * np.arange(1, horizon + 1)
        self._validator = InputValidator(self.channels, self.settings.intent_timeout)
        self._weights: dict[bytes, FloatArray] = {}
        self._largest = self._largest_intent()
        self._reference = np.tile(self.residuals.reference, (horizon, 1))
        self._frames = self.residuals.parameter_slice("tracking")
        self.reset()

    @property
    def plan(self) -> Plan | None:
        """The plan of the last update; None after a brake."""
        return self._plan

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget warm start and last command; take the obstacles of a new episode."""
        self._surroundings = Surroundings(self.model, obstacles)
        self._keep_apart()
        self._backup = Backup(self._certificate, self._limiter, self.settings.dt)
        self._parameters = self.residuals.parameters
        self._plan: Plan | None = None
        self._followed: Followed | None = None
        self._validator.reset()
        getattr(self._predict, "reset", lambda: None)()

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take what stands around now, where, how fast it moves, and what the hand holds."""
        if self._surroundings.update_scene(obstacles):
            self._keep_apart(self._margins)
            self._backup.measure_by(self._certificate)

    def _keep_apart(self, before: Margins | None = None) -> None:
        """Keep apart the pairs that there are now, which may have had margins before."""
        settings, collision = self.settings, self._surroundings.collision
        self._collision = collision
        self._margins = Margins(collision, settings.margin, settings.work_margin, before)
        self.solver.reset()  # the rows that were active are numbered by pairs
        span = settings.horizon * settings.dt
        limits = self.model.description.limits
        self._certificate = StopCertificate(
            self._limiter, collision, self._margins, settings.floor, limits, span
        )

    def set_parameters(self, objective: str, values: FloatArray) -> None:
        """Change an objective's parameters from the next update on.

        Raises:
            HandrailError: there is no such objective.
        """
        names = [entry.name for entry in self.residuals.objectives]
        if objective not in names:
            raise unknown_name("objective", objective, names)
        self._parameters[self.residuals.parameter_slice(objective)] = values

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from now on: the plan, or what `Backup` has instead; it ends at rest."""
        start = perf_counter()
        status = self._validator.check(state, intent, self._surroundings)
        plan = self._solve(state, intent) if status is Status.OK else None
        if status is Status.OK and plan is None:
            status = Status.SOLVER_FAILED
        distances = self._distances(state, plan)
        if distances is not None:
            self._margins.see(distances)
        motion, planned = self._motion(state, plan, distances, status)
        if plan is not None and not planned:
            status = Status.BACKUP
        diagnostics = self._diagnostics(status, plan, distances, start)
        command = Command(
            motion.velocities, motion.dt, self._gripper(intent, status), diagnostics, motion.elapsed
        )
        self._plan = plan if planned else None
        self._followed = following(self._followed, command, state.time, self.settings.dt)
        return command

    def problem(self, state: State, intent: Intent) -> Problem:
        """Return the optimal control problem of a state and an intent."""
        settings, size = self.settings, self.channels.size
        if self._margins.unknown:
            self._margins.see(self._collision.values(state.q[None, :])[0])
        reference = self._reference.copy()
        predicted = np.asarray(self._predict(intent, self._times), dtype=np.float64)
        cut(predicted, intent.mask, self._largest, reference)
        self._parameters[self._frames] = intent.frames.parameters
        return Problem(
            q=state.q,
            v=self._start_velocity(state),
            dt=settings.dt,
            reference=reference,
            weights=self._weights_of(intent.mask),
            parameters=self._parameters.copy(),
            channels=size,
            limits=self.model.description.limits,
            collision=self._collision,
            margins=self._margins.values,
            reach=settings.reach,
            slack_linear=settings.slack_linear,
            slack_quadratic=settings.slack_quadratic,
        )

    def _largest_intent(self) -> FloatArray:
        """Return what a command of each channel is cut to, (m,): nothing faster is possible, or wise."""
        velocity = self.model.description.limits.velocity
        tool = [self.settings.largest_speed] * 3 + [self.settings.largest_rate] * 3
        return np.concatenate([velocity[: len(self.channels.base)], tool, velocity])

    def _weights_of(self, mask: BoolArray) -> FloatArray:
        """Return the weights of all rows under a mask, (N, r), remembered for every mask met."""
        key = mask.tobytes()
        if key not in self._weights:
            weights = np.tile(self.residuals.weights(mask), (self.settings.horizon, 1))
            weights[:, : self.channels.size] *= self.settings.discounts[:, None]
            velocity = slice(self.channels.size, self.channels.size + self.model.size)
            idle = weights[-1, velocity] > 0
            weights[-1, velocity] += self.settings.terminal_velocity * idle
            self._weights[key] = weights
        return self._weights[key]

    def _solve(self, state: State, intent: Intent) -> Plan | None:
        """Return the plan, beginning with what is being sent; None where the solver fails in whatever way."""
        problem = self.problem(state, intent)
        try:
            plan = self.solver.solve(problem, self._guess(state.time)).within(problem)
        except _SOLVER_ERRORS:
            self.solver.reset()
            return None
        return plan.taken_up(problem, self._sent(state)) if plan.is_solution(problem) else None

    def _motion(
        self, state: State, plan: Plan | None, distances: FloatArray | None, status: Status
    ) -> tuple[Trajectory, bool]:
        """Return how the robot moves from now on, to rest at last, and whether it begins with the plan."""
        sent = self._sent(state)
        if distances is None:
            return self._backup.brake(sent), False
        elapsed = 0.0 if self._followed is None else self._followed.elapsed(state.time)
        situation = Situation(state.q, sent, distances, elapsed)
        way = self._backup.choose(situation, plan, halt=status in _UNHEARD)
        if plan is not None and way.planned:
            dt = self.settings.dt
            return Trajectory(self._limiter.to_rest(plan.v, dt), dt), True
        return way.motion, False

    def _sent(self, state: State) -> FloatArray:
        """Return the velocity that the robot is being sent, with which every command begins, (n,)."""
        return sent_velocity(state, self._followed, self.model.description.limits)

    def _start_velocity(self, state: State) -> FloatArray:
        """Return the velocity that a plan starts from: the one sent, if the robot keeps up."""
        return resumed(self._sent(state), state.v, self._tolerance, self.model.description.limits.velocity)

    def _guess(self, time: float) -> FloatArray:
        """Return the accelerations that are being followed from a time on, (N, n)."""
        horizon = self.settings.horizon
        if self._followed is None:
            return np.zeros((horizon, self.model.size))
        if self._plan is None:
            return self._followed.accelerations(time, horizon)
        return Trajectory(self._plan.v, self.settings.dt).accelerations(horizon, self._followed.elapsed(time))

    def _gripper(self, intent: Intent, status: Status) -> float:
        """Return how far the gripper is closed: as asked; as before where nobody is listened to."""
        if status in _UNHEARD:
            return 0.0 if self._followed is None else self._followed.command.gripper
        return min(max(intent.gripper, 0.0), 1.0)

    def _distances(self, state: State, plan: Plan | None) -> FloatArray | None:
        """Return the signed distances now, (P,); None where nobody knows where the robot is."""
        if not state.is_of(self.model.size):
            return None
        return self._collision.values(state.q[None, :])[0] if plan is None else plan.distances

    def _diagnostics(
        self, status: Status, plan: Plan | None, distances: FloatArray | None, start: float
    ) -> Diagnostics:
        if distances is None:
            return Diagnostics(status, perf_counter() - start)
        smallest, at_work = smallest_distances(distances, self._collision.work)
        if plan is None:
            return Diagnostics(
                status, perf_counter() - start, smallest_distance=smallest, work_distance=at_work
            )
        return Diagnostics(
            status,
            solve_time=perf_counter() - start,
            smallest_distance=smallest,
            work_distance=at_work,
            slack=max(plan.collision_slack, plan.limit_slack),
            tracking_error=plan.tracking_error,
            phases=plan.phases,
        )


def built_in_objectives(
    model: RobotModel, channels: Channels, settings: MpcSettings
) -> tuple[Objective, ...]:
    """Return the objectives of the paper's stage cost: tracking first, then the regularisation."""
    base = len(model.description.base_joints)
    arm = np.arange(model.size) >= base
    velocity = np.where(arm, settings.arm_velocity, settings.base_velocity)
    commanded = np.full(channels.size, settings.tracking)
    commanded[channels.tool_slice][3:] = settings.turn_tracking
    return (
        tracking(channels, commanded),
        velocity_regularisation(channels, velocity),
        acceleration_regularisation(np.full(model.size, settings.acceleration)),
        posture(channels, model.description.home, settings.posture * arm),
    )


def channel_matrix(model: RobotModel, channels: Channels, q: FloatArray) -> FloatArray:
    """Return the channels' velocities as a matrix times v, (m, n)."""
    rows = [model.jacobian(q), np.eye(model.size)]
    if channels.base:
        c, s = np.cos(q[2]), np.sin(q[2])
        base = np.zeros((3, model.size))
        base[:, :3] = [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]
        rows.insert(0, base)
    return np.vstack(rows)
