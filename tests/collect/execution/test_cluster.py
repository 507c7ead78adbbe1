"""On a Ray cluster of two computers, both here, jobs give what they give anywhere, also when one is lost."""

import os
import threading
from unittest import mock

import pytest
from command_helpers import command
from execution_helpers import dying, noted, refusing, squared, threads
from places import HELPERS
from shared_helpers import content, saved, started, wait_until

from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.execution.engine import TRIES
from handrail.collect.execution.execution import Execution
from handrail.collect.execution.job import Job

os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"  # else Ray looks for 127.0.0.1 at another address
utils = pytest.importorskip("ray.cluster_utils", reason="needs Ray: pip install '.[cluster]'")
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]
NODE = {"num_cpus": 1, "object_store_memory": 100_000_000, "node_ip_address": "127.0.0.1"}
EPISODES = 40
FLAGS = ["--task", "reach", "--time_limit", "1.0", "--seed", "3", "--dataset.num_episodes", str(EPISODES)]


@pytest.fixture(scope="module")
def cluster():
    paths = [str(HELPERS), os.environ.get("PYTHONPATH", "")]  # where the nodes find this test's jobs
    settings = {
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
        "RAY_USAGE_STATS_ENABLED": "0",
        "RAY_agent_register_timeout_ms": "300000",  # others may compute here too
    }
    with mock.patch.dict(os.environ, settings):
        made = utils.Cluster(initialize_head=True, head_node_args={**NODE, "include_dashboard": False})
        made.add_node(**NODE)
        made.wait_for_nodes(60)
        yield made
        made.shutdown()


def run(jobs, cluster):
    with Execution(ExecutionConfig(ray=cluster.address), "jobs") as execution:
        return {result.job.name: result for result in execution.run(jobs)}


def test_results_and_failures_are_those_of_any_other_place(cluster, tmp_path):
    log = tmp_path / "logs" / "refused.log"
    jobs = [Job(str(number), squared, (number,)) for number in range(12)]
    jobs += [
        Job("refused", refusing, ("the disk is full",), log=log),
        Job("after", squared, (2,), needs=("refused",)),
        Job("last", noted, (tmp_path, "last"), needs=("11",)),
        Job("threads", threads),
    ]
    found = run(jobs, cluster)
    assert [found[str(number)].value for number in range(12)] == [number**2 for number in range(12)]
    assert found["refused"].error == "the disk is full"
    assert "about to fail" in log.read_text()
    assert found["after"].error == "what it needs failed"
    assert found["threads"].value[0] == 1
    assert not found["last"].error


def test_a_killed_worker_s_job_runs_again_but_not_for_ever(cluster, tmp_path):
    jobs = [
        Job("dying", dying, (tmp_path, "dying", TRIES - 1, 7)),
        Job("poison", dying, (tmp_path, "poison", 99)),
    ]
    found = run(jobs, cluster)
    assert found["dying"].value == 7
    assert f"lost {TRIES} times with its process or computer" in found["poison"].error
    assert "\n" not in found["poison"].error
    assert len(list(tmp_path.glob("poison.*"))) == TRIES


def test_a_computer_that_is_lost_in_the_middle_costs_no_episode_and_makes_none_twice(cluster, tmp_path):
    done = command(tmp_path / "alone", *FLAGS)
    assert done.returncode == 0, done.stderr
    node, shards = cluster.add_node(**NODE), tmp_path / ".d.shards"
    kept = []

    def lose():
        wait_until(lambda: len(saved(shards)) >= EPISODES // 3)
        kept.extend(saved(shards))
        cluster.remove_node(node, allow_graceful=False)

    losing = threading.Thread(target=lose)
    losing.start()
    done = command(tmp_path / "d", *FLAGS, "--ray", cluster.address)
    losing.join()
    assert done.returncode == 0, done.stderr
    assert EPISODES // 3 <= len(kept) < EPISODES
    assert content(tmp_path / "d") == content(tmp_path / "alone")
    assert len(set(started(tmp_path / "d"))) == EPISODES
    assert sorted(os.listdir(tmp_path)) == ["alone", "d"]


def test_no_cluster_is_one_line(tmp_path, monkeypatch):
    done = command(tmp_path / "d", *FLAGS, "--ray", "127.0.0.1:1")
    assert done.returncode == 2
    assert "--ray 127.0.0.1:1: expected a running cluster (`ray start --head`)" in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "d").exists()
