"""The commands, one table of them; Ctrl-C and SIGTERM end one with one line and 130 while it loads, too."""

import atexit
import os
import signal
import sys
from types import FrameType
from typing import NoReturn

from handrail.controllers.errors import INTERRUPTED


def _leave(number: int, frame: FrameType | None) -> NoReturn:
    """End at once: a command that loads, or has done its work, holds nothing."""
    os.write(2, b"error: interrupted\n")
    os._exit(INTERRUPTED)


def _is_command() -> bool:
    """Return whether this process is a command, and no worker of one, nor a program that imports this."""
    name, processes = os.path.basename(sys.argv[0]), sys.modules.get("multiprocessing.process")
    # a worker that is being made imports the command's main module before it knows its parent
    is_worker = processes is not None and (
        processes.parent_process() is not None or hasattr(processes.current_process(), "_inheriting")
    )
    return not is_worker and (name in ("-m", "handrail") or name.startswith("handrail-"))


if _is_command():  # here, for all that a command needs is imported after this
    for _number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(_number, _leave)
        atexit.register(signal.signal, _number, signal.SIG_IGN)  # runs last: the command has its exit code
