"""A Ray cluster of two computers, both here: `python ray_nodes.py FILE` says its address in FILE.

SIGUSR1 loses one of the two; SIGTERM, or the end of who began it, ends all.
"""

import json
import os
import signal
import sys
import time
from pathlib import Path

os.environ |= {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_agent_register_timeout_ms": "600000",  # others compute here too
}
_NODE = {"num_cpus": 1, "object_store_memory": 100_000_000, "node_ip_address": "127.0.0.1"}
_MOMENT = 0.2  # [s]
_PATIENCE = 300  # [s]


def main(file: Path) -> None:
    """Run it."""
    from ray.cluster_utils import Cluster  # pyright: ignore[reportMissingImports]  (an extra)

    asked: list[int] = []
    for number in (signal.SIGUSR1, signal.SIGTERM):
        signal.signal(number, lambda which, frame: asked.append(which))
    parent = os.getppid()
    cluster = Cluster(initialize_head=True, head_node_args={**_NODE, "include_dashboard": False})
    try:
        second = cluster.add_node(**_NODE)
        cluster.wait_for_nodes(_PATIENCE)
        partial = file.with_suffix(".new")
        partial.write_text(json.dumps({"address": cluster.address, "pid": os.getpid()}))
        partial.rename(file)
        while signal.SIGTERM not in asked and os.getppid() == parent:
            if second and signal.SIGUSR1 in asked:
                cluster.remove_node(second, allow_graceful=False)
                second = None
            time.sleep(_MOMENT)
    finally:
        cluster.shutdown()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
