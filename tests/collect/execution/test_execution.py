"""Jobs give the same results wherever they run; what fails says why, what dies runs again, nothing stays."""

import io
import os
import signal
import subprocess
import sys

import pytest
from execution_helpers import (
    broken,
    dying,
    is_alive,
    leaving,
    noted,
    refusing,
    sleeping,
    squared,
    threads,
)
from places import ROOT
from rich.console import Console
from shared_helpers import wait_until
from threadpoolctl import threadpool_limits

from handrail.collect.execution.config import ExecutionConfig, cores
from handrail.collect.execution.execution import Execution
from handrail.collect.execution.job import TRIES, Job, attempt_alone
from handrail.controllers.errors import HandrailError

RAY = pytest.param("ray", marks=[pytest.mark.slow, pytest.mark.filterwarnings("ignore")])
everywhere = pytest.mark.parametrize("config", [1, 2, RAY], indirect=True)
elsewhere = pytest.mark.parametrize("config", [2, RAY], indirect=True)


def run(jobs, config=ExecutionConfig(workers=1), fresh=False, said=None, **settings):  # noqa: B008
    """Return what came of jobs, by name, in the order in which they were done."""
    console = Console(file=said or io.StringIO(), width=300)
    with Execution(config, "jobs", console, fresh=fresh) as execution:
        return {result.job.name: result for result in execution.run(jobs, **settings)}


def values(found):
    return {name: result.value for name, result in found.items()}


@everywhere
def test_results_do_not_depend_on_who_works(config):
    found = run([Job(str(number), squared, (number,)) for number in range(12)], config)
    assert values(found) == {str(n): n * n for n in range(12)}
    assert not any(result.error for result in found.values())


@everywhere
def test_a_job_begins_when_what_it_needs_is_done(config, tmp_path):
    jobs = [
        Job("last", noted, (tmp_path, "last"), needs=("middle", "first")),
        Job("middle", noted, (tmp_path, "middle"), needs=("first", "done before")),
        Job("first", noted, (tmp_path, "first")),
    ]
    assert list(run(jobs, config)) == ["first", "middle", "last"]


@everywhere
def test_a_failure_says_why_and_stops_only_what_needs_it(config):
    jobs = [
        Job("refused", refusing, ("the disk is full",)),
        Job("ours", broken),
        Job("left", leaving),
        Job("after", squared, (2,), needs=("refused",)),
        Job("long after", squared, (2,), needs=("after",)),
        Job("other", squared, (3,)),
    ]
    found = run(jobs, config)
    assert {name: result.error for name, result in found.items()} == {
        "refused": "the disk is full",
        "ours": "RuntimeError: a mistake of ours",
        "left": "SystemExit: enough",
        "after": "a job that it needs failed",
        "long after": "a job that it needs failed",
        "other": "",
    }
    assert found["other"].value == 9


@everywhere
def test_jobs_no_longer_wanted_do_not_begin(config, tmp_path):
    jobs = [Job(str(number), noted, (tmp_path, str(number))) for number in range(6)]
    found = run(jobs, config, wanted=lambda job: int(job.name) % 2 == 0)
    assert set(found) == {"0", "2", "4"}
    assert sorted(path.stem for path in tmp_path.iterdir()) == ["0", "2", "4"]


@elsewhere
def test_a_killed_worker_s_job_runs_again_and_no_other_does(config, tmp_path):
    jobs = [Job(str(number), noted, (tmp_path, str(number), number)) for number in range(8)]
    jobs.insert(3, Job("dying", dying, (tmp_path, "dying", TRIES - 1, 7)))
    found = run(jobs, config)
    assert values(found) == {str(number): number for number in range(8)} | {"dying": 7}
    times = {job.name: len(list(tmp_path.glob(f"{job.name}.*"))) for job in jobs}
    assert times == {**{str(number): 1 for number in range(8)}, "dying": TRIES}


@elsewhere
def test_a_job_that_always_kills_its_worker_is_given_up_and_named(config, tmp_path):
    jobs, said = [Job("poison", dying, (tmp_path, "poison", 99)), Job("fine", squared, (3,))], io.StringIO()
    found = run(jobs, config, said=said)
    why = (
        "lost {} times with" if config.ray else "a worker ended {} times while it did this (SIGKILL), perhaps"
    )
    assert why.format(TRIES) in found["poison"].error
    assert "\n" not in found["poison"].error
    assert found["fine"].value == 9
    assert len(list(tmp_path.iterdir())) == TRIES
    assert f"failed: poison: {why.format(TRIES)}" in said.getvalue()
    assert "failed: fine" not in said.getvalue()


def test_a_log_that_cannot_be_is_what_the_job_failed_of(tmp_path):
    (file := tmp_path / "file").touch()
    jobs = [Job("silent", squared, (3,), log=file / "x.log"), Job("fine", squared, (3,))]
    found = run(jobs, ExecutionConfig(workers=2))
    assert "file" in found["silent"].error
    assert "worker" not in found["silent"].error
    assert found["fine"].value == 9


@elsewhere
def test_every_job_has_one_thread_and_the_workers_are_few(config):
    found = values(run([Job(str(number), threads) for number in range(6)], config))
    assert {most for most, _ in found.values()} == {1}
    processes = {process for _, process in found.values()}
    assert os.getpid() not in processes
    assert len(processes) <= 2


def test_a_job_beside_others_has_one_thread_though_its_process_has_more():
    with threadpool_limits(2):
        assert threads()[0] == 2
        assert attempt_alone(Job("alone", threads)).value[0] == 1


@everywhere
def test_a_fresh_process_for_each_job_also_where_there_is_one_worker(config):
    found = values(run([Job(str(number), threads) for number in range(3)], config, fresh=True))
    processes = {process for _, process in found.values()}
    assert len(processes - {os.getpid()}) == 3
    assert config.ray or not any(map(is_alive, processes))


@elsewhere
def test_the_output_of_a_job_is_in_its_log(config, tmp_path):
    log, said = tmp_path / "logs" / "refused.log", io.StringIO()
    run([Job("refused", refusing, ("no",), log=log), Job("ours", broken, log=log)], config, said=said)
    assert "about to fail" in log.read_text()
    assert "error: no" in log.read_text()
    assert "Traceback" in log.read_text()
    assert f"failed: refused: no ({log})" in said.getvalue()


def test_leaving_early_ends_what_runs(tmp_path):
    jobs = [Job("sleeping", sleeping, (tmp_path, "sleeping")), Job("quick", squared, (2,))]
    with Execution(ExecutionConfig(workers=2), "jobs") as execution:
        for result in execution.run(jobs):
            assert result.value == 4
            wait_until(lambda: written(tmp_path / "sleeping.pid"))
            break
    assert not is_alive(int((tmp_path / "sleeping.pid").read_text()))


def written(path):
    return path.exists() and path.read_text()


SLEEPERS = """
import sys
from execution_helpers import sleeping
from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.execution.execution import Execution
from handrail.collect.execution.job import Job

def main():
    jobs = [Job(name, sleeping, (sys.argv[1], name)) for name in "ab"]
    with Execution(ExecutionConfig(workers=2), "jobs") as execution:
        list(execution.run(jobs))

if __name__ == "__main__":
    main()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_worker_outlives_whoever_gave_it_work(number, tmp_path):
    script = tmp_path / "sleepers.py"
    script.write_text(SLEEPERS)
    paths = [str(ROOT / ".links"), str(ROOT / "tests" / "helpers"), os.environ.get("PYTHONPATH", "")]
    process = subprocess.Popen(
        [sys.executable, script, tmp_path],
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))},
    )
    pids = [tmp_path / "a.pid", tmp_path / "b.pid"]
    wait_until(lambda: all(map(written, pids)))
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert ("KeyboardInterrupt" in said) == (number != signal.SIGKILL)
    wait_until(lambda: not any(is_alive(int(path.read_text())) for path in pids))


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"workers": -1}, "--workers -1: expected a whole number from 1 to 256, or 0 for all"),
        ({"workers": 1000}, "--workers 1000"),
        ({"workers": 2, "ray": "auto"}, "--ray auto and --workers 2: expected one of them"),
    ],
)
def test_wrong_settings_are_one_line(settings, words):
    with pytest.raises(HandrailError, match=words):
        ExecutionConfig(**settings).check_execution()


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({}, 8),
        ({"cpu.max": "max 100000\n"}, 8),
        ({"cpu.max": "250000 100000\n"}, 2),
        ({"cpu.max": "50000 100000\n"}, 1),
        ({"cpu/cpu.cfs_quota_us": "-1\n", "cpu/cpu.cfs_period_us": "100000\n"}, 8),
        ({"cpu/cpu.cfs_quota_us": "300000\n", "cpu/cpu.cfs_period_us": "100000\n"}, 3),
    ],
)
def test_all_cores_are_those_that_this_process_may_use(files, expected, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: range(8))
    (tmp_path / "cpu").mkdir()
    for name, content in files.items():
        (tmp_path / name).write_text(content)
    assert cores(tmp_path) == expected


def test_a_cluster_without_ray_says_how_to_install_it(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(HandrailError, match=r"--ray auto: expected ray, found none; .* '.\[cluster\]'"):
        ExecutionConfig(ray="auto").check_execution()


def test_an_interrupt_while_the_modules_of_workers_load_is_this_process_s_alone(tmp_path):
    (tmp_path / "slow.py").write_text(
        "import pathlib, time; pathlib.Path('loading').touch(); time.sleep(1.5)"
    )
    code = """
import time
from handrail.collect.execution.pool import begin_loading
try:
    begin_loading(["slow"])
    time.sleep(60)
except KeyboardInterrupt:
    print("heard")
"""
    words, pipe = [sys.executable, "-c", code], subprocess.PIPE
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    with subprocess.Popen(
        words, stdout=pipe, stderr=pipe, text=True, cwd=tmp_path, env=environment, start_new_session=True
    ) as process:
        wait_until((tmp_path / "loading").exists)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        assert process.communicate(timeout=60) == ("heard\n", "")
