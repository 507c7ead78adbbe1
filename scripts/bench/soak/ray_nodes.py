"""A Ray cluster of two computers, both here, of which one can be lost."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

_SETTINGS = {
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",  # else Ray looks for 127.0.0.1 at another address
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_agent_register_timeout_ms": "600000",  # others compute here too
}
_NODE = {"num_cpus": 1, "object_store_memory": 100_000_000, "node_ip_address": "127.0.0.1"}
_PATIENCE = 300  # [s]
_losses: list[Callable[[], object]] = []  # of the cluster that runs


@contextmanager
def cluster() -> Iterator[str]:
    """Run a cluster; give its address."""
    os.environ.update(_SETTINGS)
    from ray.cluster_utils import Cluster  # pyright: ignore[reportMissingImports]  (an extra)

    nodes: Any = Cluster(initialize_head=True, head_node_args={**_NODE, "include_dashboard": False})
    try:
        second = nodes.add_node(**_NODE)
        nodes.wait_for_nodes(_PATIENCE)
        _losses.append(partial(nodes.remove_node, second, allow_graceful=False))
        yield nodes.address
    finally:
        _losses.clear()
        nodes.shutdown()


def lose_node() -> None:
    """Lose the second node of the cluster that runs."""
    _losses.pop()()
