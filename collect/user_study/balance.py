"""The order of conditions: each as often in each place, and after each other one equally often.

E. J. Williams, Experimental designs balanced for the estimation of residual effects of treatments, Australian
Journal of Scientific Research A 2 (1949), 149-168.
"""

import numpy as np


def williams(n: int) -> list[tuple[int, ...]]:
    """Return the sequences of a Williams design: n for an even n, 2n for an odd one.

    The first sequence is `0, 1, n − 1, 2, n − 2, …`; each other one adds a constant modulo n. For an odd n
    the reversed sequences follow.

    Args:
        n: number of conditions, 1 or more.
    """
    first = [0]
    for step in range(1, n):
        first.append((first[-1] + (step if step % 2 else -step)) % n)
    sequences = [tuple((each + shift) % n for each in first) for shift in range(n)]
    return sequences + [sequence[::-1] for sequence in sequences] if n % 2 and n > 1 else sequences


def order(names: tuple[str, ...], row: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Return the order of a row of the design.

    Args:
        names: of what is ordered.
        row: counts from 0; after the last sequence the first one follows.
        rng: says which name is which number, and which sequence comes first, those of one Latin square
            before those of the other; the same for all rows.
    """
    sequences, size = williams(len(names)), len(names)
    labels = rng.permutation(size)
    places = np.concatenate([start + rng.permutation(size) for start in range(0, len(sequences), size)])
    return tuple(names[labels[each]] for each in sequences[places[row % len(sequences)]])
