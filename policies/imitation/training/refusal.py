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
        frames = traceback.walk_tb(error.__traceback__)
        names = [str(frame.f_globals.get("__name__")).partition(".")[0] for frame, _ in frames]
        known = [name for name in names if name in ("handrail", "lerobot", "accelerate")]
        if known[-1:] in ([], ["handrail"]):  # neither LeRobot nor accelerate, nor what they called
            raise
        raise HandrailError(f"policy {config.policy}: {message_of(error)}") from error
