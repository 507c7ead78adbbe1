"""The goal-reaching task as a Gymnasium environment: the policy drives the base; and how good it is at it."""

from collections import deque
from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from handrail.collect.world.tasks.goal_reaching import (
    ORIENTATION_TOLERANCE,
    POSITION_TOLERANCE,
    STEP,
    T_MAX,
    StraightPlanner,
    pose_error,
    reached,
    sample_goal,
)
from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.arm_completion import ArmCompletion, clamp_twist
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.robot.model import Pose, load_model
from handrail.policies.rl.controller import RlController
from handrail.policies.rl.observation import ACTION_SIZE, OBSERVATION_SIZE, base_velocity, observe
from handrail.policies.rl.policy import Actor
from handrail.scripts.bench.goal_reaching.config import BASELINES, BenchmarkConfig
from handrail.scripts.bench.goal_reaching.episode import Conditions, run_episode
from handrail.scripts.bench.goal_reaching.metrics import KEPT, Row, measure, summary
from handrail.scripts.bench.goal_reaching.scenes import empty_floor, plant

EVALUATION_SEED = 20_000  # of the goals watched in training, which are others
FINAL_SEED = 30_000  # of the goals that nobody saw before

_BOUND = 20.0  # of any number in an observation
_OF_ACTIONS = 0.05  # weights of the action and of its change in the reward
_MISSED = 200  # goals kept to be tried again
_FAILURES = 20  # steps off the planner's pose, by more than a success allows, that end an episode


def reward_of(d: float, r: float, action: FloatArray, previous: FloatArray) -> float:
    """Return `−½[(d/0.1)² + (r/0.05)²] − 0.05 ‖a − a⁻‖² − 0.05 ‖a‖²`, d [m] and r off the planner's pose."""
    tracking = (d / POSITION_TOLERANCE) ** 2 + (r / ORIENTATION_TOLERANCE) ** 2
    change = action - previous
    regularisation = _OF_ACTIONS * (change @ change) + _OF_ACTIONS * (action @ action)
    return -float(0.5 * tracking + regularisation)


class GoalReachingEnv(gymnasium.Env[FloatArray, FloatArray]):
    """A planner steers the tool to a goal, open loop; the action, in [−1, 1]³, drives the base.

    The damped least squares of the arm make a velocity of all joints, inside the robot's limits, and the
    benchmark's own robot follows it. An episode ends with success, after 1000 steps, or, where
    `early_failure` is on, after 20 steps off the planner's pose or when the robot touches itself or the
    floor. `reset(options={"goal": Pose(…)})` sets the goal.

    Args:
        early_failure: whether to give up an episode that has left the planner's pose.
        failure_cost: subtracted from the reward when an episode is given up.
        physics: MuJoCo, or an ideal robot whose overlapping shapes count as contacts.
        repeat_missed: share of the episodes that try again a goal that was missed before.
    """

    def __init__(
        self,
        early_failure: bool = True,
        failure_cost: float = 0.0,
        physics: bool = True,
        repeat_missed: float = 0.0,
    ) -> None:
        self.model = load_model()
        self.observation_space = spaces.Box(-_BOUND, _BOUND, (OBSERVATION_SIZE,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (ACTION_SIZE,), np.float32)
        self.arm = ArmCompletion(self.model)
        self._early_failure, self._failure_cost, self._physics = early_failure, failure_cost, physics
        self._repeat_missed = repeat_missed
        self._missed: deque[Pose] = deque(maxlen=_MISSED)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Put the robot home and draw a goal; forget the previous action."""
        super().reset(seed=seed)
        goal = (options or {}).get("goal") or self._draw()
        home = self.model.description.home
        self._plant = plant(self._physics)(self.model, empty_floor(), home, STEP)
        self.command = np.zeros(self.model.size)
        self._measure()
        self.planner = StraightPlanner.plan(*self._pose, goal)
        self._start, self._previous = self.q[:3].copy(), np.zeros(ACTION_SIZE)
        self.time = self._failures = 0
        return self._observation(), {}

    def step(self, action: FloatArray) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Drive the base for one step and let the arm follow the planner's twist."""
        action = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        base, twist = base_velocity(action, self.q[2]), clamp_twist(self.planner.twist(self.time))
        self.command = self.arm.velocity(self.q, self.command, base, twist, STEP)
        self._plant.send(np.append(self.command, 0.0))
        touches = bool(self._plant.contacts)
        self._measure()
        self.time += 1
        d, r = pose_error(*self._pose, Pose(*self.planner.pose(self.time)))
        reward = reward_of(d, r, action, self._previous)
        self._previous = action
        self._failures += not reached(d, r)
        failed = self._early_failure and (touches or self._failures >= _FAILURES)
        reward -= self._failure_cost * failed
        d_p, d_r = pose_error(*self._pose, self.planner.goal)
        success = reached(d_p, d_r) and not failed
        timed_out = self.time >= T_MAX
        if (failed or timed_out) and not success:
            self._missed.append(self.planner.goal)
        info = {"is_success": success, "failed": failed, "touches": touches}
        info |= {"position_error": d_p, "orientation_error": d_r}
        return self._observation(), reward, success or failed, timed_out, info

    def _draw(self) -> Pose:
        """Draw a goal, or take one that was missed: out of the list, into which it comes again if missed."""
        if self._repeat_missed and self._missed and self.np_random.random() < self._repeat_missed:
            index = int(self.np_random.integers(len(self._missed)))
            goal = self._missed[index]
            del self._missed[index]
            return goal
        return sample_goal(self.np_random)

    def _measure(self) -> None:
        """Look where the robot is and how it moves."""
        state, tool = self._plant.state(), self._plant.tools[0]
        self.q, self.velocity, self._pose = state.q, state.v, (tool.position, tool.rotation)

    def _observation(self) -> FloatArray:
        goal, twist = self.planner.goal, clamp_twist(self.planner.twist(self.time))
        poses = self._pose, self.planner.pose(self.time), (goal.position, goal.rotation)
        observation = observe(self.q, self._start, twist, poses, self._previous)
        return np.clip(observation, -_BOUND, _BOUND).astype(np.float32)


def evaluation_goals(count: int, seed: int = EVALUATION_SEED) -> tuple[Pose, ...]:
    """Return the goals of a seed."""
    rng = np.random.default_rng(seed)
    return tuple(sample_goal(rng) for _ in range(count))


def evaluate(actor: Actor, goals: Iterable[Pose], physics: bool = True) -> list[Row]:
    """Return what the benchmark measures of an actor on every goal."""
    model, config = load_model(), BenchmarkConfig(physics=physics)
    collision, controller = CollisionModel(model, ()), RlController(model, actor=actor)
    rows = []
    for goal in goals:
        trace = run_episode(model, BASELINES["rl"], controller, Conditions(goal, empty_floor(), config))
        rows.append(measure(trace, collision, ACTION_SIZE))
    return rows


def spreads(rows: Sequence[Row]) -> dict[str, dict[str, float]]:
    """Return mean, standard deviation, smallest and largest of every measure but times."""
    return {name: each for name, each in summary(rows).items() if name in KEPT}


def means(rows: Sequence[Row]) -> dict[str, float]:
    """Return the mean of every measure but times."""
    return {name: values["mean"] for name, values in spreads(rows).items()}
