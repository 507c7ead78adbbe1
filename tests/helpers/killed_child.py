"""A function in a process of its own that dies, as by SIGKILL, at its k-th change below a folder.

Processes are forked from a
server that has loaded LeRobot and PyTorch once, as those of a study are.
"""

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from datasets_guillotine import kill_at

from handrail.scripts.__main__ import main

_PRELOAD = [
    "handrail.collect.execution.preload",
    "handrail.policies.imitation.evaluation.evaluation",
    "handrail.policies.imitation.training.training",
]


def killed(folder: Path, change: int, function: Callable[..., object], *arguments: object) -> bool:
    """Call a function until it dies at a change; return whether it died.

    Args:
        folder: changes to what begins with this path count.
        change: the number of the last one, which is not made.
        function: to call, with its arguments.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOAD)
    log = folder.parent / "killed.log"
    process = context.Process(target=_call, args=(str(folder), change, str(log), function, arguments))
    process.start()
    process.join()
    assert process.exitcode in (0, -signal.SIGKILL), log.read_text()[-2000:]
    return process.exitcode != 0


def run_command(name: str, *flags: object) -> None:
    """Run a command of Handrail's."""
    sys.argv = [f"handrail-{name}", *map(str, flags)]
    main()


def _call(folder: str, change: int, log: str, function: Callable[..., object], arguments: tuple) -> None:
    with open(log, "w") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)

    from handrail.policies.imitation.evaluation import evaluation

    evaluation.SAVE_EVERY = 0.0  # after every rollout, so that there is much to write
    kill_at(folder, change)
    function(*arguments)
