"""A Ray cluster of two computers, both here, and a recording on it that loses a third in the middle."""

import os
import threading
from contextlib import contextmanager
from dataclasses import dataclass
from unittest import mock

from command_helpers import command
from places import HELPERS
from shared_helpers import saved, started, wait_until

os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"  # else Ray looks for 127.0.0.1 at another address
NODE = {"num_cpus": 1, "object_store_memory": 100_000_000, "node_ip_address": "127.0.0.1"}


@contextmanager
def two_computers():
    """Provide a cluster of two computers with a core each."""
    from ray.cluster_utils import Cluster

    paths = [str(HELPERS), os.environ.get("PYTHONPATH", "")]  # where the nodes find a test's jobs
    settings = {
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
        "RAY_USAGE_STATS_ENABLED": "0",
        "RAY_agent_register_timeout_ms": "300000",  # others may compute here too
    }
    with mock.patch.dict(os.environ, settings):
        made = Cluster(initialize_head=True, head_node_args={**NODE, "include_dashboard": False})
        try:
            made.add_node(**NODE)
            made.wait_for_nodes(60)
            yield made
        finally:
            made.shutdown()


@dataclass(frozen=True)
class Loss:
    """What came of a recording that lost a computer.

    Attributes:
        kept: episodes that were saved when the computer was lost.
        twice: episodes of the dataset that are not those that were saved then, though their number was.
    """

    kept: int
    twice: int


def record_with_a_loss(cluster, root, episodes, *flags):
    """Record on three computers, kill one when a third of the episodes are saved; return what came of it."""
    node, shards = cluster.add_node(**NODE), root.with_name(f".{root.name}.shards")
    begun = []

    def lose():
        wait_until(lambda: len(saved(shards)) >= episodes // 3, seconds=3600)
        begun.extend(time for path in saved(shards) for time in started(path.parents[3])[_place(path)])
        cluster.remove_node(node, allow_graceful=False)

    losing = threading.Thread(target=lose, daemon=True)
    losing.start()
    done = command(root, *flags, "--dataset.num_episodes", episodes, "--ray", cluster.address)
    assert done.returncode == 0, done.stderr
    losing.join()
    return Loss(len(begun), len(set(begun) - set(started(root))))


def _place(path):
    """Return which episode of its shard a file of lines has, as a slice."""
    number = int(path.stem.rpartition("-")[2])
    return slice(number, number + 1)
