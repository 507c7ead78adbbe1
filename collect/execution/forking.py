"""Starts the server that workers are forked from; light to import, so that it loads while its caller does."""

import multiprocessing
from collections.abc import Sequence
from multiprocessing import forkserver
from multiprocessing.context import ForkServerContext

RECORDING = ("handrail.collect.commands.shared",)
_THREADS = "handrail.collect.execution.preload"


def begin_loading(modules: Sequence[str]) -> ForkServerContext:
    """Start the server, if it does not run yet, and return what forks from it.

    Args:
        modules: that every worker needs; the first call says which.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([_THREADS, *modules])
    forkserver.ensure_running()
    return context
