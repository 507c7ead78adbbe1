"""The process in which one job of a study is done: `python -m handrail.policies.study.child FOLDER PRESET JOB`."""

import ctypes
import json
import os
import signal
import sys
import time
from pathlib import Path

from handrail.controllers.errors import HandrailError

_PR_SET_PDEATHSIG = 1  # of <sys/prctl.h>
FAILED = 1


def main(folder: str, preset: str, name: str) -> int:
    """Do a job of a study and write that it is done; return the exit code."""
    _end_with_parent()
    os.environ.setdefault("HF_HUB_OFFLINE", "1")
    from handrail.policies.study.design import load_design
    from handrail.policies.study.jobs import Layout, jobs
    from handrail.policies.study.work import fingerprint, work

    design, layout = load_design(preset), Layout(Path(folder))
    (job,) = [each for each in jobs(design) if each.name == name]
    start = time.time()
    try:
        result = work(job, design, layout)
    except HandrailError as error:
        print(f"error: {error}", file=sys.stderr)
        return FAILED
    content = {
        "settings": fingerprint(job, design),
        "result": result,
        "seconds": round(time.time() - start, 1),
    }
    path = layout.done(job)
    path.parent.mkdir(parents=True, exist_ok=True)
    staged = path.with_suffix(".part")
    staged.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    os.replace(staged, path)
    return 0


def _end_with_parent() -> None:
    """Ask Linux to end this process when the study ends, however that comes about."""
    libc = ctypes.CDLL(None, use_errno=True)
    if hasattr(libc, "prctl"):
        libc.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
