"""Runs jobs on a Ray cluster; Ray runs again what is lost with a process or a computer."""

import os
import socket
from contextlib import suppress
from dataclasses import replace
from typing import Any

import ray  # pyright: ignore[reportMissingImports]  (an extra)
from ray.exceptions import RayError, RayTaskError  # pyright: ignore[reportMissingImports]

from handrail.collect.execution.job import TRIES, Job, Result, attempt_alone
from handrail.controllers.errors import HandrailError, message_of

_MOMENT = 0.2  # [s]
PATIENCE = 10.0  # [s]
_SETTINGS = b"\x04"  # the kind of frame that opens a connection of HTTP/2, which Ray's control server speaks
_GREETING = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes(3) + _SETTINGS + bytes(5)
_TOKEN = "; if it wants a token: export RAY_AUTH_MODE=token (see docs/cluster.md)"
_AHEAD = 2  # jobs given to the cluster for each of its cores, so that none waits for the next


class Cluster:
    """Runs jobs on the cores of a cluster, one each.

    Args:
        address: of the cluster, or auto: the one that runs on this computer.
        fresh: whether every job gets a process of its own.
    """

    def __init__(self, address: str, fresh: bool = False) -> None:
        self._joined = not ray.is_initialized()
        if self._joined:
            _join(address)
        once: dict[str, Any] = {"max_calls": 1} if fresh else {}
        self._attempt: Any = ray.remote(num_cpus=1, max_retries=TRIES - 1, **once)(_attempt_in)
        self._running: dict[Any, Job] = {}

    @property
    def capacity(self) -> int:
        """How many jobs it takes at a time; computers may come and go."""
        return _AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))

    def start(self, job: Job) -> None:
        """Give a job to the cluster."""
        self._running[self._attempt.remote(job, os.getcwd())] = job

    def wait(self) -> list[Result]:
        """Wait a moment; return what has finished."""
        ready, _ = ray.wait(list(self._running), num_returns=1, timeout=_MOMENT)
        return [_result(self._running.pop(each), each) for each in ready]

    def close(self) -> None:
        """End everything that still runs, at once, and leave the cluster."""
        for each in self._running:
            with suppress(RayError):
                ray.cancel(each, force=True)
        self._running.clear()
        if self._joined:
            ray.shutdown()


def _attempt_in(job: Job, folder: str) -> Result:
    """Do a job in the folder of the command, where there is one: its relative paths begin there."""
    with suppress(OSError):
        os.chdir(folder)
    return attempt_alone(job)


def _result(job: Job, reference: Any) -> Result:
    try:
        result: Any = ray.get(reference)
    except RayTaskError as error:  # nothing that the job did: that is in its result
        why = message_of(getattr(error, "cause", None) or error)
        return Result(job, error=f"could not begin ({why}); every computer needs the same packages")
    except RayError as error:
        return Result(
            job,
            error=f"lost {TRIES} times with its process or computer; finished work is kept, and the same"
            f" command goes on: {message_of(error)}",
        )
    return replace(result, job=job)


def _join(address: str) -> None:
    try:
        _knock(address)
        ray.init(address=address, log_to_driver=False, configure_logging=False)
    except Exception as error:  # Ray says it in many ways
        hint = _TOKEN if "RAY_AUTH_MODE" not in os.environ else ""
        raise HandrailError(
            f"--ray {address}: expected a running cluster (`ray start --head`), got {message_of(error)}{hint}"
        ) from error


def _knock(address: str) -> None:
    """Check that a control server answers at an address with a port; Ray would look for it for minutes."""
    host, colon, port = address.rpartition(":")
    if not colon or "/" in address:
        return
    with socket.create_connection((host, int(port)), PATIENCE) as line:
        if os.environ.get("RAY_USE_TLS", "0") != "0":
            return
        line.sendall(_GREETING)
        answer = line.recv(9)
    if answer[3:4] != _SETTINGS:
        raise OSError(f"something else listens there, it answered {answer!r}")
