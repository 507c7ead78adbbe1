"""The ideal robot: it does exactly what it is sent, in a world where nothing can be moved."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handrail.collect.world.plant import Gate, Plant
from handrail.collect.world.scene import Scene
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.controller import State
from handrail.controllers.robot.model import RobotModel

_FAR = 0.15  # a pair that stays farther apart than this need not be measured exactly [m]


class IdealRobot(Plant):
    """A plant that integrates what it is sent; shapes that overlap count as contacts.

    Args:
        model: of the robot.
        scene: what stands around it, or moves by itself.
        q: where it begins, (n,).
        step: from one command to the next [s].
        meshes: taken for the sake of MuJoCo's robot; there is nothing to draw.
        grip: nothing, for nothing can be held.
        gate: what every command passes; by default one that sends a dataset's numbers.
    """

    def __init__(
        self,
        model: RobotModel,
        scene: Scene,
        q: FloatArray,
        step: float,
        meshes: bool = False,
        grip: tuple[float | None, ...] = (),
        gate: Gate | None = None,
    ) -> None:
        if scene.movables or any(width is not None for width in grip):
            things = ", ".join(item.name for item in scene.movables)
            raise HandrailError(f"ideal robot: expected a scene where nothing can be moved, got {things}")
        super().__init__(model, scene)
        self._step = step
        self._gate = gate or Gate(model, step)
        self._collision = CollisionModel(model, scene.obstacles())
        self._q, self._steps = np.array(q), 0
        self._distances = self._collision.values(self._q[None])[0]
        self._far = np.full(self._collision.size, _FAR)

    def state(self) -> State:
        """Return position, velocity and time."""
        return State(self._q, self._gate.velocity, self._steps * self._step, self._gate.velocity)

    def send(self, command: ArrayLike) -> NDArray[np.floating]:
        """Move by `½ h (v + v⁺)`; return what was sent."""
        before, v = self._q, self._gate.velocity
        sent = self._gate.limit(command, before)
        self._q = before + 0.5 * self._step * (v + self._gate.velocity)
        self._steps += 1
        known = (before, self._distances)
        if self._scene.movers:
            self._collision.update_scene(self.obstacles())
            known = None
        self._distances = self._collision.values(self._q[None], now=known, within=self._far)[0]
        return sent

    def checkpoint(self) -> object:
        """Return the whole state, to come back to."""
        return self._q.copy(), self._steps, self._gate.state()

    def restore(self, checkpoint: Any) -> None:
        """Come back to a state: from there all goes on as it did."""
        self._q, self._steps, sent = checkpoint
        self._gate.restore(sent)
        self._collision.update_scene(self.obstacles())
        self._distances = self._collision.values(self._q[None])[0]

    @property
    def openings(self) -> tuple[float, ...]:
        """How far grippers are open, from 0 to 1; 0 of a hand without one."""
        hands = zip(self._model.description.hands, self._gate.grippers, strict=True)
        return tuple(1.0 - closed if hand.gripper else 0.0 for hand, closed in hands)

    @property
    def contacts(self) -> tuple[str, ...]:
        """The pairs of shapes that overlap now."""
        overlaps = np.flatnonzero(self._distances < 0.0)
        return tuple(" – ".join(self._collision.pairs[index]) for index in overlaps)
