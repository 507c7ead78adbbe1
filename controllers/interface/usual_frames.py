"""Twists of an intent in the usual frames: the base's in the base, a hand's along the world's axes."""

from dataclasses import replace

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channel_matrix import channel_matrix
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import Intent
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import RobotModel

_USUAL = Frames()


def commanded_rows(intent: Intent, model: RobotModel, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return C and u of `C v = u`, the commanded channels at q, (c, n) and (c,), in whatever frames.

    Raises:
        HandrailError: A mask cannot be turned, see `in_usual_frames`.
    """
    usual = in_usual_frames(intent, model, q)
    if usual is None:
        raise HandrailError("intent: expected all axes of a turned frame, got some of them")
    matrix = channel_matrix(model, Channels.of(model.description), q)
    return matrix[usual.mask], usual.values[usual.mask]


def in_usual_frames(intent: Intent, model: RobotModel, q: FloatArray, exactly: bool = True) -> Intent | None:
    """Return the intent as it is meant in the usual frames at q, (n,); None where a mask cannot be turned.

    A mask that has some axes of a translation or a rotation, but not all three, is of its own frame alone; so
    is the translation of another tool point without the rotation. Not `exactly`, it is turned nevertheless,
    and what it then has on channels that it does not command is lost.
    Unknown frames, and values of another size, stay: the controller brakes.
    """
    channels, frames = Channels.of(model.description), intent.frames
    fits = intent.values.shape == intent.mask.shape == (channels.size,)
    if not (fits and frames.are_known) or np.array_equal(frames.parameters, _USUAL.parameters):
        return intent
    values = np.where(intent.mask, intent.values, 0.0)
    if frames.base == "world" and channels.base:
        if exactly and intent.mask[0] != intent.mask[1]:
            return None
        values[:3] = turned(values[:3], -q[2])
    if frames.tool == "world" and not frames.point.any():  # hands already are in the usual frame
        return replace(intent, values=values, frames=_USUAL)
    poses = [model.pose(q, hand.named("tool")) for hand in model.description.hands]
    places = [channels.hand_slice(hand) for hand in range(len(poses))]
    if channels.pair:  # in the axes of the first hand
        poses, places = [*poses, poses[0]], [*places, channels.pair_slice]
    for hand, (pose, place) in enumerate(zip(poses, places, strict=True)):
        parts = [slice(place.start + first, place.start + first + 3) for first in (0, 3)]
        moves, turns = (intent.mask[part] for part in parts)
        partly = any(each.any() != each.all() for each in (moves, turns))
        if exactly and (partly or (frames.point.any() and moves.any() and not turns.any())):
            return None
        rotation = np.asarray(pose.rotation)
        if frames.tool == "tool":
            for part in parts:
                values[part] = rotation @ values[part]
        if hand < len(model.description.hands):  # v of the tool point, of the one that moves with it
            values[parts[0]] -= np.cross(values[parts[1]], rotation @ frames.point)
    return replace(intent, values=values, frames=_USUAL)
