"""A process that does jobs, until nobody has any more for it."""

import os
import signal
import sys
import threading
from multiprocessing import connection, parent_process

from threadpoolctl import threadpool_limits

from handrail.collect.execution.job import Job, Result, attempt


def alone(job: Job) -> Result:
    """Do a job in a process that shares the cores with others: one BLAS thread."""
    with threadpool_limits(1):
        return attempt(job, logged=True)


def serve(jobs: "connection.Connection") -> None:
    """Do the jobs that come, and send what came of each.

    Ctrl-C is the parent's to hear. When the parent is gone, however that came, this process ends too.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _end_with_parent()
    try:
        while True:
            jobs.send(alone(jobs.recv()))
    except (EOFError, BrokenPipeError):
        return
    except KeyboardInterrupt:  # a job that saves something turns SIGTERM into it
        sys.exit(128 + signal.SIGTERM)


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        connection.wait([parent.sentinel])
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=watch, daemon=True).start()
