"""The process in which one job of a study is done.

Jobs are forked from a server that has loaded LeRobot, PyTorch and the simulator once (`preload.py`): that
takes longer than many a job.
"""

import os
import signal
import sys
import threading
import time
from multiprocessing import connection, parent_process
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.policies.study.design.design import StudyDesign
from handrail.policies.study.design.jobs import Job, Layout
from handrail.policies.study.design.settings import fingerprint
from handrail.policies.study.execution.work import begin, work
from handrail.policies.study.progress.notes import write_json

FAILED = 1


def do(job: Job, design: StudyDesign, root: Path) -> None:
    """Do a job of a study, write that it is done, and leave the process with 0, or 1 and a line."""
    layout = Layout(root)
    _end_with_parent()
    _say_into(layout.log(job))
    start = time.time()
    try:
        begin(job, design, layout)
        result = work(job, design, layout)
        settings, seconds = fingerprint(job, design), round(time.time() - start, 1)
        write_json(layout.done(job), {"settings": settings, "result": result, "seconds": seconds})
    except (HandrailError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(FAILED)


def _say_into(log: Path) -> None:
    """Send everything that this process says into a file."""
    log.parent.mkdir(parents=True, exist_ok=True)
    file = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
    for stream in (sys.stdout, sys.stderr):
        os.dup2(file, stream.fileno())
    os.close(file)


def _end_with_parent() -> None:
    """End this process when the study ends, also when that was killed; the server may outlive it."""
    study = parent_process()
    if study is None:
        return

    def watch() -> None:
        connection.wait([study.sentinel])
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=watch, daemon=True).start()
