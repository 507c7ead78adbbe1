"""Where jobs run, as typed settings; light to import."""

import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from handrail.controllers.errors import HandrailError, check_installed
from handrail.datasets.advanced import Advanced

MOST_WORKERS = 256
_CGROUP = Path("/sys/fs/cgroup")
_QUOTAS = ("cpu.max",), ("cpu/cpu.cfs_quota_us", "cpu/cpu.cfs_period_us")  # of versions 2 and 1


@dataclass(frozen=True, kw_only=True)
class ExecutionConfig:
    """Where the work is done: in this process, in several, or on a Ray cluster; the results are the same."""

    workers: int = 0
    """Processes that share the work, one core each; 0 for as many as there are cores."""
    ray: Advanced[str] = ""
    """Share the work over a Ray cluster instead: auto, or the cluster's address (see docs/cluster.md)."""

    @property
    def processes(self) -> int:
        """How many processes share the work on this computer."""
        return self.workers or cores()

    @property
    def is_shared(self) -> bool:
        """Whether the work leaves this process."""
        return bool(self.ray) or self.processes > 1

    def check_execution(self) -> None:
        """Check the settings."""
        ray, workers = f"--ray {self.ray}", f"--workers {self.workers}"
        if not 0 <= self.workers <= MOST_WORKERS:
            raise HandrailError(f"{workers}: expected a whole number from 1 to {MOST_WORKERS}, or 0 for all")
        if self.ray and self.workers != type(self).workers:
            raise HandrailError(f"{ray} and {workers}: expected one of them, got both")
        if self.ray:
            check_installed(ray, ("ray",), "cluster")


def cores(cgroup: Path = _CGROUP) -> int:
    """Return how many cores this process may use: in a container perhaps fewer than the computer has.

    Args:
        cgroup: where the system says how much time of its cores a container gets.
    """
    count = len(os.sched_getaffinity(0))
    for names in _QUOTAS:
        with suppress(OSError, ValueError):  # no such file, or "max": there is no limit
            quota, period = map(int, " ".join((cgroup / name).read_text() for name in names).split())
            if quota > 0 < period:
                count = min(count, max(1, quota // period))
    return count
