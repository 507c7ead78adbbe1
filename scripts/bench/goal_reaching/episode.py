"""One episode of the benchmark: planner, command profile, controller, robot, through the one session."""

from dataclasses import dataclass
from functools import partial
from time import process_time

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.session.session import Session
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.scene import Scene
from handrail.collect.world.task import FixedTask, Start, TaskState, Verdict
from handrail.collect.world.tasks.goal_reaching import STEP, T_MAX, StraightPlanner, pose_error, reached
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.command import Diagnostics
from handrail.controllers.interface.controller import Controller, State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.numerics.rotation import rotation_vector
from handrail.controllers.registry import resolved
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.datasets.recording.frames import Frame
from handrail.scripts.bench.goal_reaching.config import Baseline, BenchmarkConfig
from handrail.scripts.bench.goal_reaching.metrics import Trace
from handrail.scripts.bench.goal_reaching.profiles import NOTHING_YET, SPEEDS, profile_commands
from handrail.scripts.bench.goal_reaching.scenes import plant

_GAIN = 2.0  # of a planner that sees the hand [1/s]
_SETTLING = 134  # steps after the planner's last one, without early stop (4 s)


@dataclass(frozen=True)
class Conditions:
    """The conditions of an episode; the same for every controller."""

    goal: Pose  # to reach
    scene: Scene  # obstacles
    config: BenchmarkConfig  # physics, early stop, a planner that sees the hand
    profile: str = "nominal"  # how the planner's twist arrives
    seed: tuple[int, ...] = (0,)  # of the profile's noise, delays and dropouts


def run_episode(
    model: RobotModel, baseline: Baseline, controller: Controller, conditions: Conditions
) -> Trace:
    """Run a controller under some conditions and return what happened.

    Args:
        model: of the robot.
        baseline: how the controller is asked.
        controller: the baseline's; is reset.
        conditions: goal, scene, commands.
    """
    start = process_time()
    operator = _Planner(conditions, baseline, model)
    begin = Start(conditions.scene, model.description.home)
    judge = partial(_judged, given=conditions, planner=operator)
    task = FixedTask(begin, judge, time_limit=(T_MAX - 0.5) * STEP)
    env = HandrailEnv(task, model, fps=1.0 / STEP, plant=plant(conditions.config.physics))
    observer = _Observer(baseline, controller, conditions.goal)
    outcome = Session(env, controller, operator, [observer], control_period=baseline.period).run(seed=0)
    return observer.trace(operator.end, outcome.wall_time, process_time() - start)


class _Planner:
    """The planner behind a command profile: sends a message a step, of which the profile delivers some."""

    name = "planner"

    def __init__(self, conditions: Conditions, baseline: Baseline, model: RobotModel) -> None:
        self._conditions, self._ask = conditions, resolved(baseline.operator)(model)
        self._lead = np.repeat(baseline.lag, 3)

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Plan the way from here."""
        given, tool = self._conditions, view.task.tool
        speed = SPEEDS.get(given.profile, 1.0)
        self._planner = StraightPlanner.plan(tool.position, tool.rotation, given.goal, speed=speed)
        self._commands = profile_commands(given.profile, self._planner, np.random.default_rng(given.seed))
        self._sent: list[tuple[FloatArray, State]] = []
        self._error: FloatArray | None = None

    @property
    def end(self) -> int:
        """First step from which on the planner asks for nothing but rest."""
        return self._commands.end

    def act(self, view: View) -> Intent:
        """Send this step's twist; return the newest message that has arrived, stamped when it was sent."""
        step = len(self._sent)
        self._sent.append((self._twist(step, view.task.tool), view.state))
        index = int(self._commands.delivered[step])
        if index == NOTHING_YET:
            return self._ask(np.zeros(6), self._sent[0][1], step * STEP)
        twist, state = self._sent[index]
        return self._ask(twist, state, index * STEP)

    def _twist(self, step: int, tool: Pose) -> FloatArray:
        """Return a step's twist; in closed loop with a correction `k (e + T ė)` by the pose error e, (6,).

        T is the lag of what is steered: the correction leads by it. A planner that does not know it rings.
        """
        twist = self._commands.twists[step]
        if not self._conditions.config.closed_loop:
            return twist
        position, rotation = self._planner.pose(self._commands.progress[step])
        error = np.concatenate([position - tool.position, rotation_vector(rotation @ tool.rotation.T)])
        change = np.zeros(6) if self._error is None else (error - self._error) / STEP
        self._error = error
        return twist + _GAIN * (error + self._lead * change)


def _judged(state: TaskState, given: Conditions, planner: _Planner) -> Verdict:
    """Say whether the goal is reached: at once, or some time after the planner's end."""
    success = reached(*pose_error(state.tool.position, state.tool.rotation, given.goal))
    if given.config.early_stop:
        return Verdict(success)
    over = state.time > (planner.end + _SETTLING - 0.5) * STEP
    return Verdict(success and over, "missed" if over and not success else "")


class _Observer:
    """Tells a controller that has to know it the goal; notes what happens, step by step."""

    def __init__(self, baseline: Baseline, controller: Controller, goal: Pose) -> None:
        self._baseline, self._controller, self._goal = baseline, controller, goal

    def begin(self, env: HandrailEnv, seed: int) -> None:
        if self._baseline.aims:
            self._controller.aim(self._goal)  # pyright: ignore[reportAttributeAccessIssue]
        self._plant = env.plant
        self._states, self._tools = [self._plant.state()], [self._plant.tools[0]]
        self._contacts: list[tuple[str, ...]] = []
        self._updates: dict[int, Diagnostics] = {}  # an update's are in all frames until the next

    def see(self, frame: Frame) -> None:
        self._states.append(self._plant.state())
        self._tools.append(self._plant.tools[0])
        self._contacts.append(self._plant.contacts)
        self._updates[id(frame.diagnostics)] = frame.diagnostics

    def trace(self, end: int, wall_time: float, cpu_time: float) -> Trace:
        """Return what was noted."""
        return Trace(
            q=np.array([state.q for state in self._states]),
            v=np.array([state.v for state in self._states[1:]]),
            errors=np.array(
                [pose_error(tool.position, tool.rotation, self._goal) for tool in self._tools[1:]]
            ),
            hand=np.array([tool.position for tool in self._tools]),
            contacts=self._contacts,
            updates=list(self._updates.values()),
            end=end,
            wall_time=wall_time,
            cpu_time=cpu_time,
        )
