"""What LeRobot refuses, and what the disk does, as errors of ours; an error in Handrail itself stays one."""

import traceback
from collections.abc import Iterator
from contextlib import contextmanager

from handrail.controllers.errors import HandrailError, message_of
from handrail.policies.imitation.config import TrainConfig

_REFUSALS = (ValueError, TypeError, AssertionError, ImportError, RuntimeError)


@contextmanager
def in_one_line(config: TrainConfig) -> Iterator[None]:
    """Turn what is raised while a policy is built or trained into one line."""
    try:
        yield
    except OSError as error:
        raise HandrailError(f"training in {config.output}: {message_of(error)}") from error
    except _REFUSALS as error:
        if not _of_lerobot(error):
            raise
        raise HandrailError(f"policy {config.policy}: {message_of(error)}") from error


def _of_lerobot(error: BaseException) -> bool:
    """Return whether LeRobot or accelerate, or what they called, raised it; not Handrail or the rest."""
    modules = [str(frame.f_globals.get("__name__")) for frame, _ in traceback.walk_tb(error.__traceback__)]
    packages = [name.partition(".")[0] for name in modules]
    known = [name for name in packages if name in ("handrail", "lerobot", "accelerate")]
    return known[-1:] not in ([], ["handrail"])
