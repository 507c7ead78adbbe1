"""The masked model predictive controller: the operator steers a part, the optimum completes the rest."""

from time import perf_counter

from handrail.controllers.arrays import FloatArray, IntArray, are_finite
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.errors import SOLVER_ERRORS
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Command, Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.prediction import Prediction, constant
from handrail.controllers.interface.sources import OfSources
from handrail.controllers.interface.validation import InputValidator
from handrail.controllers.mpc.build import ProblemBuilder, built_in_objectives
from handrail.controllers.mpc.loop_state import LoopState
from handrail.controllers.mpc.supervision import Supervisor
from handrail.controllers.objectives.objective import Objective
from handrail.controllers.objectives.together import TOGETHER, together, together_parameters
from handrail.controllers.ocp.problem import Plan, Problem
from handrail.controllers.ocp.residuals import StageResiduals
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle
from handrail.controllers.safety.limiter import Limiter
from handrail.controllers.solvers.real_time import NOTHING_ACTIVE, RealTimeSolver


class MaskedMpc:
    """Masked MPC of the paper's equation (6); a controller.

    An update is `build_problem`, `solve` and `Supervisor.supervise`, none of which changes anything: what
    lasts from update to update is one frozen value, `loop`.

    Args:
        model: of the robot.
        settings: weights, margins, horizon; made to the measure of the robot's world by default.
        objectives: autonomous objectives besides the built-in ones; `together` of a robot with two hands is
            built in too, unless it is among them with weights of its own.
        predict: intent prediction Ψ of every source that brings none of its own.

    Attributes:
        channels: the robot's command channels.
        loop: what lasts from the last update to the next.
    """

    def __init__(
        self,
        model: RobotModel,
        settings: MpcSettings | None = None,
        objectives: tuple[Objective, ...] = (),
        predict: Prediction = constant,
    ) -> None:
        self.model = model
        self.settings = settings or MpcSettings.of(model.description.world.scale)
        self.channels = Channels.of(model.description)
        built_in = built_in_objectives(model, self.channels, self.settings)
        lacks_pair = self.channels.pair and TOGETHER not in [each.name for each in objectives]
        pair = (together(self.channels),) if lacks_pair else ()
        horizon = self.settings.horizon
        self.residuals = StageResiduals(model, (*built_in, *objectives, *pair), horizon)
        self.solver = RealTimeSolver(self.residuals, horizon, model.size)
        self._builder = ProblemBuilder(model, self.settings, self.residuals)
        self._validator = InputValidator(self.channels, self.settings.intent_timeout)
        self._supervisor = Supervisor(Limiter(model.description), self.settings, len(self.channels.hands))
        self._predict = OfSources(predict, self._builder.largest)
        self.reset()

    @property
    def plan(self) -> Plan | None:
        """The plan of the last update; None after a brake."""
        return self.loop.plan

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the past (warm start, last command); take the obstacles of a new episode."""
        collision = CollisionModel(self.model, obstacles)
        around = Surroundings.of(collision, self.settings.margin, self.settings.work_margin)
        self.loop = LoopState(around, self.residuals.parameters, self._predict)

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take what stands around now, where, how fast it moves, and what the hand holds."""
        self.loop = self.loop.among(obstacles)

    def set_parameters(self, objective: str, values: FloatArray) -> None:
        """Change an objective's parameters from the next update on."""
        parameters = self.loop.parameters.copy()
        parameters[self.residuals.parameter_slice(objective)] = values
        self.loop = self.loop._replace(parameters=parameters)

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from now on: the plan, or what `Backup` has instead; it ends at rest."""
        start, plan = perf_counter(), None
        makes_sense = self.loop.surroundings.make_sense
        status, inputs = self._validator.check(state, intent, makes_sense, self.loop.inputs)
        loop = self.loop._replace(inputs=inputs)
        if status is Status.OK:
            loop = self._facing(loop, state, intent)
            plan, active = self.solve(self._builder.build(loop, state, intent), loop, state)
            loop = loop._replace(active=active)
            status = Status.SOLVER_FAILED if plan is None else Status.OK
        command, self.loop = self._supervisor.supervise(loop, state, intent, plan, status, start)
        return command

    def build_problem(self, state: State, intent: Intent) -> Problem:
        """Return the optimal control problem of a state and an intent; a question that changes nothing."""
        return self._builder.build(self._facing(self.loop, state, intent), state, intent)

    def _facing(self, loop: LoopState, state: State, intent: Intent) -> LoopState:
        """Return the loop's state in which a problem is built; a pair stays as it is at a new mask."""
        if not self.channels.pair:
            return loop.facing(state, intent, self.channels)
        mask, pair, joints = intent.mask, self.channels.pair_slice, self.channels.joint_slice
        alone = mask[len(self.channels.base) : pair.start].any() or mask[joints].any()
        steered = bool(mask[pair].any()), bool(mask[pair][-1]), bool(alone)
        if steered[0] and steered != loop.paired:
            parameters, place = loop.parameters.copy(), self.residuals.parameter_slice(TOGETHER)
            parameters[place] = together_parameters(self.model, state.expected)
            loop = loop._replace(parameters=parameters)
        return loop.facing(state, intent, self.channels)._replace(paired=steered)

    def solve(self, problem: Problem, loop: LoopState, state: State) -> tuple[Plan | None, IntArray]:
        """Return the plan, beginning with what is being sent, and the active rows; None where solving fails.

        Args:
            problem: of the state.
            loop: the warm start.
            state: of the robot.
        """
        guess = loop.guess(state.time, self.settings.horizon, self.model.size)
        try:
            plan = self.solver.solve(problem, guess, loop.active)
        except SOLVER_ERRORS:
            return None, NOTHING_ACTIVE
        valid = plan.solved and are_finite(plan.v.ravel()) and are_finite(plan.q.ravel())
        return plan if valid else None, plan.active
