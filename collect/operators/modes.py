"""Teleop modes: which channels an operator owns, and how a wish becomes values on them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from handrail.collect.operators.steering import Gains
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.channels import TOOL, Channels
from handrail.controllers.errors import unknown_name
from handrail.controllers.model import RobotModel

Focus = Literal["hand", "base"]
Completion = Literal["mpc", "direct", "filter", "cbf"]
JOINT_SPEED = 0.8  # full stick of one joint [rad/s]
_DAMPING = 0.03
_BASE_WEIGHT = 0.3


@dataclass(frozen=True)
class Wish:
    """What an operator wants the robot to do now, whatever the mode.

    Attributes:
        hand: twist of the tool, world-aligned, (6,) [m/s, rad/s].
        base: twist of the base in the base frame, (3,).
        focus: which of the two matters now.
        gripper: 0 open, 1 closed.
    """

    hand: FloatArray
    base: FloatArray
    focus: Focus = "hand"
    gripper: float = 0.0


@dataclass(frozen=True)
class TeleopMode:
    """A named mask with an input map.

    Attributes:
        name: as on the command line.
        groups: channel groups that the operator owns, by focus.
        controller: what becomes of the command: `mpc` completes it, `filter` and `cbf` keep it safe, `direct`
            clips it to limits only.
        help: one line.
    """

    name: str
    groups: Callable[[Focus], tuple[str, ...]]
    controller: Completion
    help: str


def _always(*groups: str) -> Callable[[Focus], tuple[str, ...]]:
    return lambda focus: groups


def _by_focus(focus: Focus) -> tuple[str, ...]:
    return ("base",) if focus == "base" else ("ee",)


MODES = {
    mode.name: mode
    for mode in (
        TeleopMode("ee", _always("ee"), "mpc", "steer the hand; the base comes along by itself"),
        TeleopMode("base", _always("base"), "mpc", "steer the base; the arm keeps clear by itself"),
        TeleopMode("base+ee", _always("base", "ee"), "mpc", "steer base and hand at once"),
        TeleopMode("joints", _always("joint"), "mpc", "steer every joint, kept safe by the MPC"),
        TeleopMode("switching", _by_focus, "mpc", "drive the base, then steer the hand"),
        TeleopMode(
            "direct", _always("joint"), "direct", "all joint velocities, clipped to limits only: the baseline"
        ),
        TeleopMode(
            "direct_filtered",
            _always("joint"),
            "filter",
            "all joint velocities through the multi-step predictive safety filter",
        ),
        TeleopMode(
            "direct_cbf", _always("joint"), "cbf", "all joint velocities through a one-step CBF safety filter"
        ),
    )
}


def without(mode: TeleopMode, left: tuple[str, ...]) -> TeleopMode:
    """Return a mode whose operator leaves some tool channels alone, where the mode has them by group."""
    if not left:
        return mode
    kept = tuple(name for name in TOOL if name not in left)

    def groups(focus: Focus) -> tuple[str, ...]:
        return tuple(name for group in mode.groups(focus) for name in (kept if group == "ee" else (group,)))

    return replace(mode, groups=groups)


def find_mode(name: str) -> TeleopMode:
    """Return a mode by name.

    Raises:
        HandrailError: there is no such mode.
    """
    if name not in MODES:
        raise unknown_name("teleop mode", name, MODES)
    return MODES[name]


class InputMap:
    """Turns a wish into values on the channels of a mode.

    Args:
        model: of the robot.
        mode: the teleop mode.
        gains: full stick of hand and base.
    """

    def __init__(self, model: RobotModel, mode: TeleopMode, gains: Gains) -> None:
        self.mode = mode
        self.channels = Channels.of(model.description)
        self._model = model
        self._gains = gains

    @property
    def full(self) -> FloatArray:
        """Full stick of every channel, (m,)."""
        base = self._gains.full[6:][: len(self.channels.base)]
        joints = np.full(self._model.size, JOINT_SPEED)
        joints[: len(base)] = base
        return np.concatenate([base, self._gains.full[:6], joints])

    def mask(self, focus: Focus) -> BoolArray:
        """Return the channels that the operator owns, (m,)."""
        return self.channels.mask(*self.mode.groups(focus))

    def values(self, wish: Wish, q: FloatArray) -> FloatArray:
        """Return the wish on every channel of the mode, zero elsewhere, within full stick, (m,)."""
        mask = self.mask(wish.focus)
        values = np.zeros(self.channels.size)
        values[self.channels.base_slice] = wish.base[: len(self.channels.base)]
        values[self.channels.tool_slice] = wish.hand
        if mask[self.channels.joint_slice].any():
            values[self.channels.joint_slice] = self._joint_velocities(wish, q)
        return np.clip(np.where(mask, values, 0.0), -self.full, self.full)

    def _joint_velocities(self, wish: Wish, q: FloatArray) -> FloatArray:
        """Return the expert's inner inverse kinematics, (n,).

        `min ‖J v - hand‖² + w_b ‖v_base - base‖² + λ ‖v / v_max‖²`: the hand first, the base when it can.
        """
        jacobian = self._model.jacobian(q)
        base = self._base_world(wish, q)
        weights = np.full(self._model.size, _DAMPING) / self._model.description.limits.velocity
        rows = [jacobian, np.diag(weights)]
        targets = [wish.hand, np.zeros(self._model.size)]
        if len(base):
            rows.append(_BASE_WEIGHT * np.eye(len(base), self._model.size))
            targets.append(_BASE_WEIGHT * base)
        solution: FloatArray = np.linalg.lstsq(np.vstack(rows), np.concatenate(targets), rcond=None)[0]
        return solution / max(1.0, float(np.max(np.abs(solution) / self.full[self.channels.joint_slice])))

    def _base_world(self, wish: Wish, q: FloatArray) -> FloatArray:
        if not self.channels.base:
            return np.zeros(0)
        c, s = np.cos(q[2]), np.sin(q[2])
        vx, vy, wz = wish.base
        return np.array([c * vx - s * vy, s * vx + c * vy, wz])
