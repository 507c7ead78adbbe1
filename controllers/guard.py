"""The checks that every controller makes before it listens to an intent."""

from handrail.controllers.channels import Channels
from handrail.controllers.command import Status
from handrail.controllers.controller import State
from handrail.controllers.intent import Intent


def check_inputs(state: State, intent: Intent, channels: Channels, timeout: float) -> Status:
    """Return `ok`, or why the robot must brake.

    Args:
        state: as measured.
        intent: of the operator.
        channels: of the robot.
        timeout: age from which an intent is stale [s].
    """
    size = len(channels.joints)
    if state.q.shape != (size,) or state.v.shape != (size,) or not state.is_finite:
        return Status.INVALID_STATE
    if intent.values.shape != (channels.size,) or intent.mask.shape != (channels.size,):
        return Status.INVALID_INTENT
    if not (intent.is_finite and intent.frames.are_known):
        return Status.INVALID_INTENT
    if state.time - intent.time > timeout:
        return Status.STALE_INTENT
    return Status.OK
