"""One episode of the benchmark: planner, command profile, controller, robot."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter, process_time

import numpy as np

from handrail.collect.experiments.benchmark.catalogue import Baseline
from handrail.collect.experiments.benchmark.metrics import Trace
from handrail.collect.experiments.benchmark.plants import Plant, build_plant
from handrail.collect.experiments.benchmark.profiles import NOTHING_YET, SPEEDS, Commands, profile_commands
from handrail.collect.simulation.scene import Scene
from handrail.collect.tasks.goal_reaching import STEP, T_MAX, Goal, StraightPlanner, pose_error, reached
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import Controller, State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.numerics.rotation import rotation_vector
from handrail.controllers.registry import resolved
from handrail.controllers.robot.model import Pose, RobotModel

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

    goal: Goal
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
    start = perf_counter(), process_time()
    plant = build_plant(model, conditions.scene, conditions.physics)
    controller.reset(conditions.scene.obstacles())
    if baseline.aim:
        resolved(baseline.aim)(controller, conditions.goal)
    operator = _Operator(conditions, plant.tool, resolved(baseline.operator)(model))
    tally = _Tally(plant, conditions.goal)
    last = T_MAX if conditions.early_stop else min(T_MAX, operator.end + _SETTLING)
    drive = _Drive(controller, baseline.period or STEP)
    for step in range(last):
        operator.send(step, tally.state, tally.tool)
        velocity = drive.velocity(step, tally.state, operator)
        tally.add(plant.advance(velocity, 0.0))
        if conditions.early_stop and tally.reached:
            break
    spent = perf_counter() - start[0], process_time() - start[1]
    return tally.trace(drive, operator.end, spent)


class _Operator:
    """The planner behind a command profile: sends a message a step, of which the profile delivers some."""

    def __init__(
        self, conditions: Conditions, tool: Pose, intents: Callable[[FloatArray, State, float], Intent]
    ) -> None:
        speed = SPEEDS.get(conditions.profile, 1.0)
        self._planner = StraightPlanner.plan(tool.position, tool.rotation, conditions.goal, speed=speed)
        rng = np.random.default_rng(conditions.seed)
        self._commands: Commands = profile_commands(conditions.profile, self._planner, rng)
        self._closed = conditions.closed_loop
        self._intents = intents
        self._sent: list[tuple[FloatArray, State]] = []

    @property
    def end(self) -> int:
        """First step from which on the planner asks for nothing but rest."""
        return self._commands.end

    def send(self, step: int, state: State, tool: Pose) -> None:
        """Decide on this step's twist; with closed loop, on top of it `k` times the pose error."""
        twist = self._commands.twists[step]
        if self._closed:
            position, rotation = self._planner.pose(self._commands.progress[step])
            turn = rotation_vector(rotation @ tool.rotation.T)
            twist = twist + _GAIN * np.concatenate([position - tool.position, turn])
        self._sent.append((twist, state))

    def intent(self, step: int) -> Intent:
        """Return the newest message that has arrived, with the time at which it was sent."""
        index = int(self._commands.delivered[step])
        if index == NOTHING_YET:
            return self._intents(np.zeros(6), self._sent[0][1], step * STEP)
        twist, state = self._sent[index]
        return self._intents(twist, state, index * STEP)


class _Drive:
    """Asks the controller when its time has come and follows the command's trajectory in between."""

    def __init__(self, controller: Controller, period: float) -> None:
        self._controller, self._period = controller, period
        self._due, self._asked = 0.0, 0
        self.commands: list[Command] = []

    def velocity(self, step: int, state: State, operator: _Operator) -> FloatArray:
        """Return the velocity at the end of a step: interpolated on the predicted trajectory, (n,)."""
        if step * STEP >= self._due - 1e-9:
            self.commands.append(self._controller.update(state, operator.intent(step)))
            self._asked = step
            self._due += self._period
        return self.commands[-1].velocity((step + 1 - self._asked) * STEP)


class _Tally:
    """Notes what happens, step by step; knows where the robot is now."""

    def __init__(self, plant: Plant, goal: Goal) -> None:
        self._plant, self._goal = plant, goal
        self.state, self.tool = plant.state(), plant.tool
        self._q, self._hand = [self.state.q], [self.tool.position]
        self._v: list[FloatArray] = []
        self._errors: list[tuple[float, float]] = []
        self._contacts: list[tuple[str, ...]] = []

    @property
    def reached(self) -> bool:
        """Whether the hand is at the goal."""
        return reached(*self._errors[-1])

    def add(self, contacts: tuple[str, ...]) -> None:
        """Note where the robot is after a step."""
        self.state, self.tool = state, tool = self._plant.state(), self._plant.tool
        self._q.append(state.q)
        self._v.append(state.v)
        self._hand.append(tool.position)
        self._errors.append(pose_error(tool.position, tool.rotation, self._goal))
        self._contacts.append(contacts)

    def trace(self, drive: _Drive, end: int, spent: tuple[float, float]) -> Trace:
        """Return what was noted."""
        return Trace(
            q=np.array(self._q),
            v=np.array(self._v),
            errors=np.array(self._errors),
            hand=np.array(self._hand),
            contacts=self._contacts,
            statuses=[command.diagnostics.status for command in drive.commands],
            solve_times=[command.diagnostics.solve_time for command in drive.commands],
            end=end,
            wall_time=spent[0],
            cpu_time=spent[1],
        )
