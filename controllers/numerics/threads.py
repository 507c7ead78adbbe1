"""One BLAS thread while a control loop runs.

The matrices of an update are small: a second thread gains nothing, and waiting for one that another process
has pushed aside costs milliseconds (measured on two shared cores: p99 of one product 13 ms against 0.07 ms).
"""

from contextlib import AbstractContextManager

from threadpoolctl import threadpool_limits


def single_threaded() -> AbstractContextManager[object]:
    """Return a context in which BLAS uses one thread; what was set before returns after it."""
    return threadpool_limits(limits=1, user_api="blas")
