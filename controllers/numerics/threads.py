"""One BLAS thread while a control loop runs.

The matrices of an update are small: a second thread gains nothing, and waiting for one that another process
has pushed aside costs milliseconds (measured on two shared cores: p99 of one product 13 ms against 0.07 ms).
"""

import sys
from contextlib import AbstractContextManager
from functools import lru_cache

from threadpoolctl import ThreadpoolController


def single_threaded() -> AbstractContextManager[object]:
    """Return a context in which BLAS uses one thread; what was set before returns after it."""
    return _libraries(len(sys.modules)).limit(limits=1, user_api="blas")


@lru_cache(maxsize=1)
def _libraries(modules: int) -> ThreadpoolController:
    """Return the libraries that are loaded; they are looked for again once another module is."""
    return ThreadpoolController()
