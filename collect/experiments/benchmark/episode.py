"""One episode of the benchmark: planner, command profile, controller, robot, through the one session."""

from collections.abc import Callable
from dataclasses import dataclass
from time import process_time

import numpy as np

from handrail.collect.envs.env import HandrailEnv
from handrail.collect.experiments.benchmark.catalogue import Baseline
from handrail.collect.experiments.benchmark.metrics import Trace
from handrail.collect.experiments.benchmark.plants import plant
from handrail.collect.experiments.benchmark.profiles import NOTHING_YET, SPEEDS, Commands, profile_commands
from handrail.collect.operators.operator import View
from handrail.collect.session.outcome import Outcome
from handrail.collect.session.session import Session
from handrail.collect.simulation.scene import Scene
from handrail.collect.tasks.goal_reaching import STEP, T_MAX, StraightPlanner, pose_error, reached
from handrail.collect.tasks.task import Start, TaskState, Verdict
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.command import Diagnostics
from handrail.controllers.interface.controller import Controller, State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.numerics.rotation import rotation_vector
from handrail.controllers.registry import resolved
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.datasets.recording.frames import Frame

_GAIN = 1.0  # of a planner that sees the hand [1/s]
_SETTLING = 134  # steps after the planner's last one, without early stop (4 s)


@dataclass(frozen=True)
class Conditions:
    """What an episode is run under; the same for every controller.

    Attributes:
        goal: to reach.
        scene: obstacles.
        profile: how the planner's twist arrives.
        seed: of the profile's noise, delays and dropouts.
        physics: MuJoCo, or an ideal robot.
        early_stop: end at the first success.
        closed_loop: the planner sees the hand.
    """

    goal: Pose
    scene: Scene
    profile: str = "nominal"
    seed: tuple[int, ...] = (0,)
    physics: bool = True
    early_stop: bool = True
    closed_loop: bool = False


def run_episode(
    model: RobotModel, baseline: Baseline, controller: Controller, conditions: Conditions
) -> Trace:
    """Run a controller under some conditions and return what happened.

    Args:
        model: of the robot.
        baseline: how the controller is asked.
        controller: what its `build` returned; is reset.
        conditions: goal, scene, commands.
    """
    start = process_time()
    operator = _Planner(
        conditions, resolved(baseline.operator)(model), lambda: _aim(baseline, controller, conditions.goal)
    )
    task, build = _Task(conditions, operator), plant(conditions.physics)
    env = HandrailEnv(task, model, fps=1.0 / STEP, plant=build, observes=False)
    tracer = _Tracer(conditions.goal)
    outcome = Session(env, controller, operator, [tracer], control_period=baseline.period).run(seed=0)
    return tracer.trace(operator.end, outcome, process_time() - start)


def _aim(baseline: Baseline, controller: Controller, goal: Pose) -> None:
    if baseline.aim:
        resolved(baseline.aim)(controller, goal)


class _Planner:
    """The planner behind a command profile: sends a message a step, of which the profile delivers some."""

    def __init__(
        self,
        conditions: Conditions,
        intents: Callable[[FloatArray, State, float], Intent],
        aim: Callable[[], None],
    ) -> None:
        self._conditions, self._intents, self._aim = conditions, intents, aim

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Plan the way from here, and say where it leads to a controller that has to know."""
        given, tool = self._conditions, view.tool
        speed = SPEEDS.get(given.profile, 1.0)
        self._planner = StraightPlanner.plan(tool.position, tool.rotation, given.goal, speed=speed)
        noise = np.random.default_rng(given.seed)
        self._commands: Commands = profile_commands(given.profile, self._planner, noise)
        self._sent: list[tuple[FloatArray, State]] = []
        self._aim()

    @property
    def end(self) -> int:
        """First step from which on the planner asks for nothing but rest."""
        return self._commands.end

    def act(self, view: View) -> Intent:
        """Send this step's twist; return the newest message that has arrived, stamped when it was sent."""
        step = len(self._sent)
        self._sent.append((self._twist(step, view.tool), view.state))
        index = int(self._commands.delivered[step])
        if index == NOTHING_YET:
            return self._intents(np.zeros(6), self._sent[0][1], step * STEP)
        twist, state = self._sent[index]
        return self._intents(twist, state, index * STEP)

    def _twist(self, step: int, tool: Pose) -> FloatArray:
        """Return a step's twist; with closed loop, on top of it `k` times the pose error, (6,)."""
        twist = self._commands.twists[step]
        if not self._conditions.closed_loop:
            return twist
        position, rotation = self._planner.pose(self._commands.progress[step])
        turn = rotation_vector(rotation @ tool.rotation.T)
        return twist + _GAIN * np.concatenate([position - tool.position, turn])


@dataclass(frozen=True)
class _Task:
    """Reaching the goal from home: over at the first success, or some time after the planner's end."""

    conditions: Conditions
    planner: _Planner
    description: str = "Reach the goal."
    horizon: float = (T_MAX - 0.5) * STEP
    state_names: tuple[str, ...] = ()

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        return Start(self.conditions.scene, model.description.home)

    def features(self, state: TaskState) -> FloatArray:
        return np.zeros(0)

    def outcome(self, state: TaskState) -> Verdict:
        success = reached(*pose_error(state.tool.position, state.tool.rotation, self.conditions.goal))
        if self.conditions.early_stop:
            return Verdict(success)
        over = state.time > (self.planner.end + _SETTLING - 0.5) * STEP
        return Verdict(success and over, "missed" if over and not success else "")


class _Tracer:
    """Notes what happens, step by step; an observer."""

    def __init__(self, goal: Pose) -> None:
        self._goal = goal

    def begin(self, env: HandrailEnv, seed: int) -> None:
        self._env = env
        self._q, self._hand = [env.robot.state().q], [env.world.tool.position]
        self._v: list[FloatArray] = []
        self._errors: list[tuple[float, float]] = []
        self._contacts: list[tuple[str, ...]] = []
        self._updates: list[Diagnostics] = []

    def see(self, frame: Frame) -> None:
        state, tool = self._env.robot.state(), self._env.world.tool
        self._q.append(state.q)
        self._v.append(state.v)
        self._hand.append(tool.position)
        self._errors.append(pose_error(tool.position, tool.rotation, self._goal))
        self._contacts.append(self._env.world.contacts)
        if not self._updates or frame.diagnostics is not self._updates[-1]:
            self._updates.append(frame.diagnostics)

    def trace(self, end: int, outcome: Outcome, cpu_time: float) -> Trace:
        """Return what was noted."""
        return Trace(
            q=np.array(self._q),
            v=np.array(self._v),
            errors=np.array(self._errors),
            hand=np.array(self._hand),
            contacts=self._contacts,
            statuses=[update.status for update in self._updates],
            solve_times=[update.solve_time for update in self._updates],
            end=end,
            wall_time=outcome.wall_time,
            cpu_time=cpu_time,
        )
