"""An actor with random weights."""

import itertools

import numpy as np

from handrail.policies.rl.policy import Actor

SIZES = (54, 16, 8, 3)


def random_actor(seed: int = 0) -> Actor:
    rng = np.random.default_rng(seed)
    weights = tuple(rng.normal(size=(out, into)) for into, out in itertools.pairwise(SIZES))
    return Actor(weights, tuple(rng.normal(size=size) for size in SIZES[1:]))
