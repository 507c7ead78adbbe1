"""PyTorch's process-wide state during a rollout: its random numbers and its threads.

PyTorch is left alone where no policy has loaded it.
"""

import contextlib
import sys
from collections.abc import Iterator


@contextlib.contextmanager
def repeatable(seed: int) -> Iterator[None]:
    """Let what a policy draws depend on the seed alone; what others draw is as before."""
    torch = sys.modules.get("torch")
    if torch is None:
        yield
        return
    with torch.random.fork_rng(devices=[]):
        torch.random.default_generator.manual_seed(seed)
        yield


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Let PyTorch use one thread: the networks are small, and processes share the cores."""
    torch = sys.modules.get("torch")
    if torch is None:
        yield
        return
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
