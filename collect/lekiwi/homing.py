"""Brings an arm to where an episode begins, slowly and clear of everything."""

import numpy as np

from handrail.collect.lekiwi.link import Link
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.shape import Obstacle

_GAIN = 2.0  # of a joint towards its place [1/s]
_SPEED = 0.5  # of a joint, at most [rad/s, m/s]
_NEAR = 0.04  # that is there [rad, m]
_ENOUGH = 0.25  # that is near enough where the arm comes no nearer: its own limits come first [rad, m]
_CALM = 5  # periods there in a row
_STUCK = 40  # periods without coming nearer
_PATIENCE = 20.0  # [s]


def bring_home(link: Link, q: FloatArray, obstacles: tuple[Obstacle, ...] = ()) -> None:
    """Move the arm to its part of q, or as near as it may come to itself; the base stands.

    Raises:
        HandrailError: it is not near after twenty seconds.
    """
    description = link.model.description
    base, channels = len(description.base_joints), Channels.of(description)
    mpc = MaskedMpc(link.model)
    mpc.reset(() if base else obstacles)  # where a base stands is not known yet
    mask, values = channels.mask("joint"), np.zeros(channels.size)
    calm = stuck = 0
    nearest = np.inf
    for _ in range(round(_PATIENCE / link.period)):
        away = (q - link.state.q)[base:]
        farthest = np.abs(away).max()
        calm = calm + 1 if farthest < _NEAR else 0
        stuck = 0 if farthest < nearest - 0.25 * _NEAR else stuck + 1
        nearest = min(nearest, farthest)
        if calm >= _CALM or (stuck >= _STUCK and farthest < _ENOUGH):
            return
        values[channels.joint_slice.start + base :] = np.clip(_GAIN * away, -_SPEED, _SPEED)
        command = mpc.update(link.state, Intent(values, mask, time=link.state.time))
        link.exchange(np.append(command.velocity(link.period), 0.0))
    worst = int(np.argmax(np.abs((q - link.state.q)[base:])))
    raise HandrailError(
        f"robot {description.name}: joint {description.arm_joints[worst]} does not come to where the episode "
        f"begins: {link.state.q[base + worst]:.2f} instead of {q[base + worst]:.2f} rad; put the arm near it"
    )
