"""How good a policy of the reinforcement-learning baseline is, on goals that never change."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from handrail.collect.world.tasks.goal_reaching import STEP, sample_goal
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import Pose
from handrail.scripts.bench.goal_reaching.metrics import arm_effort, jerkiness
from handrail.scripts.bench.rl.env import GoalReachingEnv

EVALUATION_SEED = 20_000  # of the goals watched in training, which are others
FINAL_SEED = 30_000  # of the goals that nobody saw before

Policy = Callable[[FloatArray], FloatArray]

Score = dict[str, float]
"""One episode, in the terms of the paper's Table I: success, position_error at the end [m] and
orientation_error, length [steps], arm_effort, base_path [m], jerkiness, contacts [steps]."""


def evaluation_goals(count: int, seed: int = EVALUATION_SEED) -> tuple[Pose, ...]:
    """Return the goals of a seed."""
    rng = np.random.default_rng(seed)
    return tuple(sample_goal(rng) for _ in range(count))


def evaluate(policy: Policy, goals: Iterable[Pose], physics: bool = True) -> list[Score]:
    """Return the score of every goal, early failure off."""
    env = GoalReachingEnv(early_failure=False, physics=physics)
    return [_score(env, policy, goal) for goal in goals]


def spreads(scores: Sequence[Score]) -> dict[str, dict[str, float]]:
    """Return mean, standard deviation, smallest and largest of every measure."""
    columns = {name: [score[name] for score in scores] for name in scores[0]}
    return {
        name: {"mean": float(np.mean(x)), "std": float(np.std(x)), "min": min(x), "max": max(x)}
        for name, x in columns.items()
    }


def means(scores: Sequence[Score]) -> dict[str, float]:
    """Return the mean of every measure."""
    return {name: values["mean"] for name, values in spreads(scores).items()}


def _score(env: GoalReachingEnv, policy: Policy, goal: Pose) -> Score:
    """Run a policy until the episode ends."""
    observation, _ = env.reset(options={"goal": goal})
    velocities, contacts, done, info = [], 0, False, {}
    while not done:
        observation, _, terminated, truncated, info = env.step(policy(observation))
        velocities.append(env.velocity)
        contacts += info["touches"]
        done = terminated or truncated
    v = np.array(velocities)  # (T, 9)
    return {
        "success": float(info["is_success"]),
        "position_error": info["position_error"],
        "orientation_error": info["orientation_error"],
        "length": float(len(v)),
        "arm_effort": arm_effort(v[:, 3:]),
        "base_path": float(STEP * np.linalg.norm(v[:, :2], axis=1).sum()),
        "jerkiness": jerkiness(v),
        "contacts": float(contacts),
    }
