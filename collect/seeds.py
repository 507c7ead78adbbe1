"""Seeds of episodes: those of recordings, of evaluations and of encoders never meet."""

import numpy as np

FIRST_SEED = 2**32  # of evaluations; recordings use the numbers below it
MOST_ROLLOUTS = 1_000_000  # of an evaluation, of each policy


def mixed_seed(*numbers: int) -> int:
    """Return a seed of 32 bits from several numbers, far apart for each combination."""
    return int(np.random.SeedSequence(numbers).generate_state(1)[0])


def episode_seed(seed: int, episode: int, attempt: int = 0) -> int:
    """Return the seed of a recording's episode: far apart for every seed and number.

    Args:
        seed: of the recording.
        episode: its number.
        attempt: how many with this number the operator has thrown away.
    """
    return mixed_seed(seed, episode, attempt)


def evaluation_seed(seed: int, episode: int) -> int:
    """Return the seed of an episode of an evaluation, `2³² + 10⁶ seed + episode`."""
    return FIRST_SEED + MOST_ROLLOUTS * seed + episode


def encoder_seed(seed: int, chunk: int, episode: int) -> int:
    """Return the seed of an episode that an encoder learns from; no evaluation has it."""
    return 2**100 + (seed << 64) + (chunk << 32) + episode
