"""A LeKiwi in MuJoCo as its host sees it: joint targets and wheel speeds in, positions and speeds out."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from handrail.collect.processor.units import RobotUnits, number
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import turned

SIZES = {"front": (480, 640), "wrist": (640, 480)}  # of LeRobot's pictures, height and width
_STIFFNESS = 12.0  # of the position servos: speed per error [1/s]
_AT_ONCE = 0.5  # of what it has fallen behind it catches up so much in a round [s]


class LeKiwiBody:
    """Moves as it was told last; what is not told goes on.

    The arm's servos go to their targets, `v = k (q* − q)`, within the limits of the description. The base
    keeps its twist until it is told another one, or to stop.

    Args:
        env: the world, with the robot in it.
        units: LeKiwi's names and units.

    Attributes:
        contacts: forbidden ones begun since the episode began.
        done_at: when the task was done first [s]; not so far if NaN.
    """

    def __init__(self, env: HandrailEnv, units: RobotUnits) -> None:
        assert units.base is not None
        assert units.grippers[0] is not None
        self._env, self._units, self._base, self._grip = env, units, units.base, units.grippers[0]

    def reset(self, seed: int) -> None:
        """Begin an episode."""
        self._env.reset(seed=seed)
        self._arm, self._twist = self._env.state().q[3:].copy(), np.zeros(3)
        self._gripper = float(any(width is not None for width in self._env.start.grip))
        self._touching: frozenset[str] = frozenset()
        self.contacts, self.done_at = 0, math.nan

    def take(self, action: Mapping[str, Any]) -> bool:
        """Take a command as LeKiwi does: the base's three velocities, and any of the arm's targets.

        Returns:
            Whether it made sense; one that does not changes nothing.
        """
        twist = np.array([number(action, name) for name in self._base.twist])
        now = self._units.action(self._arm, np.zeros(len(self._arm)), self._twist, (self._gripper,))
        names = (*self._units.positions, self._grip.name)
        said = {name: number(action, name) for name in names if name in action}
        if not np.isfinite(twist).all() or not all(map(math.isfinite, said.values())):
            return False
        now |= said
        self._twist = twist * self._base.scale
        self._arm = self._units.joint_positions(np.array([now[name] for name in self._units.positions]))
        self._gripper = self._grip.closing(now[self._grip.name])
        return True

    def stop_base(self) -> None:
        """Stop the wheels; the arm stays at its targets."""
        self._twist = np.zeros(3)

    def advance(self, until: float) -> None:
        """Let time pass, until so long after the episode's beginning [s]; at most half a second at once."""
        steps = math.floor((until - self._env.plant.time) * self._env.fps + 1e-6)
        for _ in range(min(steps, math.ceil(_AT_ONCE * self._env.fps))):
            self._step()

    @property
    def time(self) -> float:
        """Since the episode began [s]."""
        return self._env.plant.time

    @property
    def base(self) -> FloatArray:
        """Where the base really is, (3,) [m, rad]."""
        return self._env.state().q[:3]

    def observation(self) -> dict[str, float]:
        """Return what LeKiwi says: joint positions, and the speeds of its wheels as the base's."""
        state, world = self._env.state(), self._env.plant
        twist = turned(state.v[:3], -state.q[2])
        return self._units.action(state.q[3:], state.v[3:], twist, (1.0 - world.openings[0],))

    def picture(self, camera: str) -> np.ndarray:
        """Return what a camera of LeKiwi's sees, (height, width, 3)."""
        return self._env.paint(camera, camera, SIZES[camera])

    def _step(self) -> None:
        state = self._env.state()
        velocity = np.append(turned(self._twist, state.q[2]), _STIFFNESS * (self._arm - state.q[3:]))
        *_, info = self._env.step(np.append(velocity, self._gripper))
        touching = frozenset(info["contact_names"])
        self.contacts += len(touching - self._touching)
        self._touching = touching
        if info["is_success"] and math.isnan(self.done_at):
            self.done_at = self._env.plant.time
