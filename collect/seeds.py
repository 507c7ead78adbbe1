"""Seeds of the episodes of an evaluation, and of an encoder: none is of a recording."""

FIRST_SEED = 2**32  # of evaluations; recordings use the numbers below it
MOST_ROLLOUTS = 1_000_000  # of an evaluation, of each policy


def evaluation_seed(seed: int, episode: int) -> int:
    """Return the seed of an episode of an evaluation, `2³² + 10⁶ seed + episode`."""
    return FIRST_SEED + MOST_ROLLOUTS * seed + episode


def encoder_seed(seed: int, chunk: int, episode: int) -> int:
    """Return the seed of an episode that an encoder learns from; no evaluation has it."""
    return 2**100 + (seed << 64) + (chunk << 32) + episode
