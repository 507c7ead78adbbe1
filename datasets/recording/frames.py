"""What Handrail records of every moment: the columns of a frame."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.command import Diagnostics
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.trajectory import Trajectory
from handrail.datasets.format.schema import Feature

FARTHEST = 10.0  # [m] what a distance is cut to: nothing is nearer, there is nothing to measure, or no state
MOST = 1e6  # [m/s, rad/s, …] what any other number is cut to


@dataclass(frozen=True)
class Frame:
    """One control period: what was observed, asked, commanded, and how the controller fared.

    Attributes:
        state: the robot as observed, (s,); `observation.state`.
        environment: the task as observed, (e,); `observation.environment_state`.
        images: pictures by camera, (height, width, 3) uint8 each.
        intent: what the operator asked for.
        action: what was sent to the robot: velocities at the end of the period and the gripper, (n + 1,).
        command: what the controller asked for, (n + 1,); the robot's own limits may have cut it.
        diagnostics: of the controller.
        contacts: forbidden contacts in the period.
        success: whether the task is done at the end of the period.
        done: whether the episode ends with it.
        wall_clock: wall time since the episode began [s].
        number: its place in the episode; after an undo it has been there before.
        safe: how many frames, from the first on, no undo will take back.
        undos: how often the operator has gone back in this episode.
        plan: where the controller leads the robot from here; shown, not recorded.
        commanded: wall time since the episode began at which the command was there [s]; shown, not recorded.
    """

    state: FloatArray
    environment: FloatArray
    images: dict[str, np.ndarray]
    intent: Intent
    action: FloatArray
    command: FloatArray
    diagnostics: Diagnostics
    contacts: int
    success: bool
    done: bool
    wall_clock: float
    number: int
    safe: int = sys.maxsize
    undos: int = 0
    plan: Trajectory | None = None
    commanded: float = 0.0


def frame_features(
    state: Sequence[str],
    environment: Sequence[str],
    joints: Sequence[str],
    channels: Sequence[str],
    cameras: Sequence[str] = (),
    image_size: tuple[int, int] = (128, 128),
) -> dict[str, Feature]:
    """Return the columns of a robot, a task and its cameras.

    Policy inputs are under `observation.*`, the policy output is `action`; the rest is beside them, so that
    LeRobot's policies do not read it.

    Args:
        state: names of the observed robot state.
        environment: names of the observed task state.
        joints: names of the generalised coordinates.
        channels: names of the command channels.
        cameras: names of the cameras.
        image_size: height and width [pixels].
    """
    scalar = Feature("float32")
    asked = (*channels, "gripper")
    pictures = {f"observation.images.{name}": Feature("video", (*image_size, 3)) for name in cameras}
    velocities = (*(f"v_{name}" for name in joints), "gripper")
    return {
        "observation.state": Feature("float32", (len(state),), tuple(state)),
        "observation.environment_state": Feature("float32", (len(environment),), tuple(environment)),
        **pictures,
        "action": Feature("float32", (len(velocities),), velocities),
        "teleop.values": Feature("float32", (len(asked),), asked),
        "teleop.mask": Feature("bool", (len(asked),), asked),
        "teleop.mode": Feature("string"),
        "teleop.raw": Feature("float32", (len(channels),), tuple(channels)),
        "teleop.axes": Feature("int64"),
        "teleop.switches": Feature("int64"),
        "teleop.device": Feature("string"),
        "teleop.age": scalar,
        "teleop.round_trip": scalar,
        "teleop.undos": Feature("int64"),
        "controller.command": Feature("float32", (len(velocities),), velocities),
        "controller.solve_time": scalar,
        "controller.status": Feature("string"),
        "controller.slack": scalar,
        "controller.smallest_distance": scalar,
        "controller.work_distance": scalar,
        "safety.contacts": Feature("int64"),
        "next.success": Feature("bool"),
        "next.done": Feature("bool"),
        "wall_clock": Feature("float64"),
    }


def frame_row(frame: Frame) -> dict[str, Any]:
    """Return a moment as a frame of `frame_features`.

    What stands beside a policy's inputs and outputs is finite too: no tool's statistics may become NaN.
    """
    intent, raw, diagnostics = frame.intent, frame.intent.raw.values, frame.diagnostics
    pictures = {f"observation.images.{name}": image for name, image in frame.images.items()}
    return {
        "observation.state": frame.state,
        "observation.environment_state": frame.environment,
        **pictures,
        "action": frame.action,
        "teleop.values": _finite(np.append(np.where(intent.mask, intent.values, 0.0), intent.gripper)),
        "teleop.mask": np.append(intent.mask, True),
        "teleop.mode": intent.mode,
        "teleop.raw": _finite(raw if raw.size else np.zeros(len(intent.values))),
        "teleop.axes": intent.raw.axes,
        "teleop.switches": intent.raw.switches,
        "teleop.device": intent.raw.device,
        "teleop.age": _finite(intent.raw.age),
        "teleop.round_trip": _finite(intent.raw.round_trip),
        "teleop.undos": frame.undos,
        "controller.command": frame.command,
        "controller.solve_time": diagnostics.solve_time,
        "controller.status": diagnostics.status.value,
        "controller.slack": _finite(diagnostics.slack),
        "controller.smallest_distance": finite_distance(diagnostics.smallest_distance),
        "controller.work_distance": finite_distance(diagnostics.work_distance),
        "safety.contacts": frame.contacts,
        "next.success": frame.success,
        "next.done": frame.done,
        "wall_clock": frame.wall_clock,
    }


def _finite(numbers: FloatArray | float) -> FloatArray:
    """Return numbers cut to ±`MOST`; what is none becomes 0."""
    within = np.clip(numbers, -MOST, MOST)
    return np.where(np.isnan(within), 0.0, within)


def finite_distance(distance: float) -> float:
    """Return a distance cut to `FARTHEST`, which also stands for one that nobody knows [m]."""
    return min(distance, FARTHEST) if np.isfinite(distance) else FARTHEST
