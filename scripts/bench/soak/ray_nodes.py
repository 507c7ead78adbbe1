"""A Ray cluster of two computers, both here: `python ray_nodes.py FILE` writes its address into FILE.

SIGUSR1 loses one of the two; SIGTERM, or the end of its parent, ends all.
"""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from handrail.scripts.bench.soak.child import send, session, wait_until

_SETTINGS = {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_agent_register_timeout_ms": "600000",  # others compute here too
}
_NODE = {"num_cpus": 1, "object_store_memory": 100_000_000, "node_ip_address": "127.0.0.1"}
_MOMENT = 0.2  # [s]
_PATIENCE = 300  # [s]
_STARTS, _ENDS = 600.0, 120.0  # [s]
_FILE = "cluster.json"  # in the folder of the work


@contextmanager
def cluster(folder: Path) -> Iterator[str]:
    """Run a cluster for the work in a folder; give its address."""
    os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"  # else Ray looks for 127.0.0.1 at another address
    file, log = folder / _FILE, folder / "cluster.log"
    with open(log, "w") as output:
        words = [sys.executable, __file__, str(file)]
        process = subprocess.Popen(words, stdout=output, stderr=output, start_new_session=True)
    try:
        wait_until(lambda: file.exists() or process.poll() is not None, _STARTS)
        if not file.exists():
            raise TimeoutError(f"no Ray cluster: {log.read_text()[-300:]}")
        yield json.loads(file.read_text())["address"]
    finally:
        process.terminate()
        try:
            process.wait(_ENDS)
        except subprocess.TimeoutExpired:
            send(signal.SIGKILL, *session(process.pid))
            process.wait()


def lose_node(folder: Path) -> None:
    """Lose one node of the cluster for the work in a folder."""
    os.kill(json.loads((folder / _FILE).read_text())["pid"], signal.SIGUSR1)


def main(file: Path) -> None:
    """Run it."""
    os.environ.update(_SETTINGS)
    from ray.cluster_utils import Cluster  # pyright: ignore[reportMissingImports]  (an extra)

    asked: list[int] = []
    for number in (signal.SIGUSR1, signal.SIGTERM):
        signal.signal(number, lambda which, frame: asked.append(which))
    parent = os.getppid()
    nodes = Cluster(initialize_head=True, head_node_args={**_NODE, "include_dashboard": False})
    try:
        second = nodes.add_node(**_NODE)
        nodes.wait_for_nodes(_PATIENCE)
        partial = file.with_suffix(".new")
        partial.write_text(json.dumps({"address": nodes.address, "pid": os.getpid()}))
        partial.rename(file)
        while signal.SIGTERM not in asked and os.getppid() == parent:
            if second and signal.SIGUSR1 in asked:
                nodes.remove_node(second, allow_graceful=False)
                second = None
            time.sleep(_MOMENT)
    finally:
        nodes.shutdown()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
