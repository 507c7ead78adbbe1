"""What Handrail records of every moment: the columns of a frame."""

import math
import sys
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray, IntArray
from handrail.controllers.interface.command import Diagnostics
from handrail.controllers.interface.intent import LONG_AGO, Intent
from handrail.controllers.interface.sources import PERSON, POLICY, Intents
from handrail.controllers.interface.trajectory import Trajectory
from handrail.datasets.format.schema import Feature

FARTHEST = 10.0  # [m] what a distance is cut to: nothing is nearer, there is nothing to measure, or no state
MOST = 1e6  # [m/s, rad/s, …] what any other number is cut to


@dataclass(frozen=True)
class Frame:
    """One control period: what was observed, asked, commanded, and how the controller fared."""

    state: FloatArray  # the robot as observed, (s,); `observation.state`
    environment: FloatArray  # the task as observed, (e,); `observation.environment_state`
    images: dict[str, np.ndarray]  # pictures by camera, (height, width, 3) uint8 each
    intent: Intent  # what the operator asked for
    action: FloatArray
    """The command sent to the robot: velocities at the end of the period and grippers, (n + h,)."""
    command: FloatArray  # what the controller asked for, (n + h,); the robot's own limits may have cut it
    diagnostics: Diagnostics  # of the controller
    contacts: int  # forbidden contacts in the period
    success: bool  # whether the task is done at the end of the period
    done: bool  # whether the episode ends with it
    wall_clock: float  # wall time since the episode began [s]
    number: int  # its place in the episode; after an undo it has been there before
    safe: int = sys.maxsize  # how many frames, from the first on, no undo will take back
    undos: int = 0  # how often the operator has gone back in this episode
    plan: Trajectory | None = None  # where the controller leads the robot from here; shown, not recorded
    commanded: float = 0.0
    """Wall time since the episode began at which the command was there [s]; shown, not recorded."""


@dataclass(frozen=True)
class Column:
    """A column of what is recorded of every moment."""

    name: str  # of the column
    dtype: str  # of its numbers
    value: Callable[[Frame], Any]  # what a frame has in it
    parts: str = ""  # which names its numbers have; none for a single one


COLUMNS = (
    Column("observation.state", "float32", lambda frame: frame.state, "state"),
    Column("observation.environment_state", "float32", lambda frame: frame.environment, "environment"),
    Column("action", "float32", lambda frame: frame.action, "velocities"),
    Column("teleop.values", "float32", lambda frame: _asked(frame.intent), "asked"),
    Column("teleop.mask", "bool", lambda frame: _owned(frame.intent), "asked"),
    Column("teleop.mode", "string", lambda frame: frame.intent.mode),
    Column("teleop.raw", "float32", lambda frame: _raw(frame.intent), "channels"),
    Column("teleop.axes", "int64", lambda frame: frame.intent.raw.axes),
    Column("teleop.switches", "int64", lambda frame: frame.intent.raw.switches),
    Column("teleop.device", "string", lambda frame: frame.intent.raw.device),
    Column("teleop.age", "float32", lambda frame: _finite_number(frame.intent.raw.age)),
    Column("teleop.round_trip", "float32", lambda frame: _finite_number(frame.intent.raw.round_trip)),
    Column("teleop.undos", "int64", lambda frame: frame.undos),
    Column("controller.command", "float32", lambda frame: frame.command, "velocities"),
    Column("controller.solve_time", "float32", lambda frame: _finite_number(frame.diagnostics.solve_time)),
    Column("controller.status", "string", lambda frame: frame.diagnostics.status.value),
    Column("controller.slack", "float32", lambda frame: _finite_number(frame.diagnostics.slack)),
    Column(
        "controller.smallest_distance", "float32", lambda f: finite_distance(f.diagnostics.smallest_distance)
    ),
    Column("controller.work_distance", "float32", lambda f: finite_distance(f.diagnostics.work_distance)),
    Column("safety.contacts", "int64", lambda frame: frame.contacts),
    Column("next.success", "bool", lambda frame: frame.success),
    Column("next.done", "bool", lambda frame: frame.done),
    Column("wall_clock", "float64", lambda frame: frame.wall_clock),
)
"""The recorded columns of every moment, beside the pictures: one line a column.

Policies read `observation.*` and write `action`; LeRobot leaves the rest alone.
All numbers are finite: no tool's statistics may become NaN.
"""
BY_POLICY, BY_PERSON = 1, 2
"""What `owner` has added up of whoever commands a channel or a gripper; 0 of what the MPC completes alone."""
OWNER, INTERVENTION, MASK = "owner", "intervention", "teleop.mask"
SHARED_COLUMNS = (
    Column(OWNER, "int64", lambda frame: _owners(frame.intent), "asked"),
    Column(INTERVENTION, "bool", lambda frame: bool(np.any(_owners(frame.intent) >= BY_PERSON))),
    Column("policy.values", "float32", lambda frame: _asked(_of_policy(frame.intent)), "asked"),
    Column("policy.age", "float32", lambda frame: _finite_number(_of_policy(frame.intent).raw.age)),
)
"""Further columns, where a policy steers beside a person."""
PICTURE = "observation.images."


def frame_features(
    state: Sequence[str],
    environment: Sequence[str],
    joints: Sequence[str],
    channels: Sequence[str],
    cameras: Sequence[str] = (),
    image_size: tuple[int, int] = (128, 128),
    grippers: Sequence[str] = ("gripper",),
    shared: bool = False,
) -> dict[str, Feature]:
    """Return the columns of a robot, a task and its cameras.

    Args:
        state: names of the observed robot state.
        environment: names of the observed task state.
        joints: names of the generalised coordinates.
        channels: names of the command channels.
        cameras: names of the cameras.
        image_size: height and width [pixels].
        grippers: names of those of the hands.
        shared: whether a policy steers beside the person.
    """
    names = {
        "state": tuple(state),
        "environment": tuple(environment),
        "velocities": (*(f"v_{name}" for name in joints), *grippers),
        "channels": tuple(channels),
        "asked": (*channels, *grippers),
    }
    columns = COLUMNS + SHARED_COLUMNS * shared
    features = {column.name: Feature(column.dtype) for column in columns} | {
        column.name: Feature(column.dtype, (len(names[column.parts]),), names[column.parts])
        for column in columns
        if column.parts
    }
    observed = {name: each for name, each in features.items() if name.startswith("observation.")}
    pictures = {PICTURE + name: Feature("video", (*image_size, 3)) for name in cameras}
    return observed | pictures | features


def frame_row(frame: Frame, features: Container[str] = ()) -> dict[str, Any]:
    """Return a moment as a frame of `frame_features`, with those shared columns that the features have."""
    pictures = {PICTURE + name: image for name, image in frame.images.items()}
    columns = (*COLUMNS, *(column for column in SHARED_COLUMNS if column.name in features))
    return {column.name: column.value(frame) for column in columns} | pictures


def shared_features(features: Mapping[str, Feature]) -> dict[str, Feature]:
    """Return the columns of a dataset that are there because a policy steered beside the person."""
    names = [column.name for column in SHARED_COLUMNS]
    return {name: features[name] for name in names} if {MASK, *names} <= set(features) else {}


def of_demonstration(mask: BoolArray) -> dict[str, np.ndarray]:
    """Return the shared columns of frames without a policy: whoever drove owns their mask, (N, m + h)."""
    return {
        OWNER: BY_PERSON * mask.astype(np.int64),
        INTERVENTION: np.zeros(len(mask), bool),
        "policy.values": np.zeros(mask.shape, np.float32),
        "policy.age": np.zeros(len(mask), np.float32),
    }


def _asked(intent: Intent) -> FloatArray:
    return _finite(np.concatenate((np.where(intent.mask, intent.values, 0.0), intent.grippers)))


def _owned(intent: Intent) -> BoolArray:
    return np.concatenate((intent.mask, np.ones(len(intent.grippers), dtype=bool)))


def _owners(intent: Intent) -> IntArray:
    """Return who commands each channel and gripper, (m + h,); nobody while nobody is listened to."""
    hands = len(intent.grippers)
    owners = np.zeros(len(intent.mask) + hands, np.int64)
    if intent.time <= LONG_AGO or not intent.is_finite:  # the robot brakes
        return owners
    if not isinstance(intent, Intents):  # the person alone
        return owners + BY_PERSON * _owned(intent)
    for name, number in ((POLICY, BY_POLICY), (PERSON, BY_PERSON)):
        if source := intent.source(name):
            grippers = [name in intent.of_grippers[hand : hand + 1] for hand in range(hands)]
            owners += number * np.concatenate((intent.mask & (source.share() > 0.0), grippers))
    return owners


def _of_policy(intent: Intent) -> Intent:
    """Return what the policy wants; nothing, on no channel, without a usable answer that is listened to."""
    source = intent.source(POLICY) if isinstance(intent, Intents) and intent.time > LONG_AGO else None
    nothing = Intent(np.zeros(len(intent.mask)), np.zeros(len(intent.mask), bool))
    return (source.intent if source else nothing).of_hands(len(intent.grippers))


def _raw(intent: Intent) -> FloatArray:
    return _finite(intent.raw.values if intent.raw.values.size else np.zeros(len(intent.values)))


def _finite(numbers: FloatArray) -> FloatArray:
    """Return numbers cut to ±`MOST`; what is none becomes 0."""
    if numbers.dot(numbers) <= MOST:  # all are
        return numbers
    return np.nan_to_num(np.clip(numbers, -MOST, MOST))


def _finite_number(number: float) -> float:
    return 0.0 if math.isnan(number) else min(max(number, -MOST), MOST)


def finite_distance(distance: float) -> float:
    """Return a distance cut to `FARTHEST`, which also stands for one that nobody knows [m]."""
    return min(distance, FARTHEST) if math.isfinite(distance) else FARTHEST
