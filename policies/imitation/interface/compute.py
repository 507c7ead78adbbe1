"""Where PyTorch computes, and by how many threads."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from handrail.controllers.errors import unknown_name


def device_of(device: str) -> str:
    """Return a device that is there: cpu, cuda, cuda:1, mps."""
    available = {"cpu": True, "cuda": torch.cuda.is_available(), "mps": torch.backends.mps.is_available()}
    if not available.get(device.partition(":")[0], False):
        raise unknown_name("device", device, [name for name, here in available.items() if here])
    return device


@contextmanager
def threads(count: int) -> Iterator[None]:
    """Let PyTorch use so many threads: processes share the cores."""
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)
