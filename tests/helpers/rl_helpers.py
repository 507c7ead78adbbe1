"""An actor with random weights."""

import itertools

import numpy as np

from handrail.policies.rl.policy import Actor
from handrail.scripts.bench.rl.config import TrainRlConfig

SIZES = (54, 16, 8, 3)


def random_actor(seed: int = 0) -> Actor:
    rng = np.random.default_rng(seed)
    weights = tuple(rng.normal(size=(out, into)) for into, out in itertools.pairwise(SIZES))
    return Actor(weights, tuple(rng.normal(size=size) for size in SIZES[1:]))


TINY_RL = TrainRlConfig(
    **{"steps": 60, "random_steps": 20, "layers": (8, 8), "batch_size": 8},
    **{"save_every": 40, "goals": 1, "final_goals": 2},
)
"""Settings of a training of a moment."""
