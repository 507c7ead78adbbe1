"""How good a policy of the reinforcement-learning baseline is, on goals that never change."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from handrail.collect.tasks.goal_reaching import STEP, sample_goal
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import Pose
from handrail.policies.rl.env import GoalReachingEnv

EVALUATION_SEED = 20_000  # of the goals watched in training, which are others
FINAL_SEED = 30_000  # of the goals that nobody saw before

Policy = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class EpisodeScore:
    """One episode, in the terms of the paper's Table I.

    Attributes:
        success: whether the goal was reached.
        position_error: at the end [m].
        orientation_error: at the end.
        length: steps.
        arm_effort: Σ ‖q̇_arm‖².
        base_path: Σ ‖Δp_base‖ [m].
        jerkiness: mean ‖Δq̇‖ / h.
        contacts: steps in which the robot touched itself or the floor.
    """

    success: bool
    position_error: float
    orientation_error: float
    length: int
    arm_effort: float
    base_path: float
    jerkiness: float
    contacts: int


def evaluation_goals(count: int, seed: int = EVALUATION_SEED) -> tuple[Pose, ...]:
    """Return the goals of a seed."""
    rng = np.random.default_rng(seed)
    return tuple(sample_goal(rng) for _ in range(count))


def run_episode(env: GoalReachingEnv, policy: Policy, goal: Pose) -> EpisodeScore:
    """Run a policy until the episode ends."""
    observation, _ = env.reset(options={"goal": goal})
    velocities, contacts, done, info = [], 0, False, {}
    while not done:
        observation, _, terminated, truncated, info = env.step(policy(observation))
        velocities.append(env.velocity)
        contacts += info["touches"]
        done = terminated or truncated
    v = np.array(velocities)  # (T, 9)
    return EpisodeScore(
        success=info["is_success"],
        position_error=info["position_error"],
        orientation_error=info["orientation_error"],
        length=len(v),
        arm_effort=float(np.sum(v[:, 3:] ** 2)),
        base_path=float(STEP * np.linalg.norm(v[:, :2], axis=1).sum()),
        jerkiness=float(np.linalg.norm(np.diff(v, axis=0), axis=1).mean() / STEP),
        contacts=contacts,
    )


def evaluate(policy: Policy, goals: Sequence[Pose], physics: bool = True) -> list[EpisodeScore]:
    """Return the score of every goal, early failure off."""
    env = GoalReachingEnv(early_failure=False, physics=physics)
    return [run_episode(env, policy, goal) for goal in goals]


def means(scores: Sequence[EpisodeScore]) -> dict[str, float]:
    """Return the mean of every measure."""
    return {name: values["mean"] for name, values in spreads(scores).items()}


def spreads(scores: Sequence[EpisodeScore]) -> dict[str, dict[str, float]]:
    """Return mean, standard deviation, smallest and largest of every measure."""
    columns = {
        entry.name: [float(getattr(score, entry.name)) for score in scores] for entry in fields(EpisodeScore)
    }
    return {
        name: {"mean": float(np.mean(x)), "std": float(np.std(x)), "min": min(x), "max": max(x)}
        for name, x in columns.items()
    }
