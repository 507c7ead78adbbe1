"""A robot and the world around it, as a session asks them, and the last gate before a robot."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import closed
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Obstacle
from handrail.controllers.safety.limiter import Limiter

if TYPE_CHECKING:  # which loads MuJoCo
    from handrail.collect.world.scene import Scene


class Plant(ABC):
    """A robot that follows velocities, one command a period, and the world by whose truth a task judges.

    It is the one owner of what the robot was sent last. Where nothing can be moved, nothing is held.

    Args:
        model: of the robot.
        scene: what stands around it.
    """

    def __init__(self, model: RobotModel, scene: "Scene") -> None:
        self._model, self._scene = model, scene

    @property
    def is_stable(self) -> bool:
        """Whether the physics went well so far."""
        return True

    @abstractmethod
    def state(self) -> State:
        """Return the measured positions, velocities and time, and the velocity that was sent last."""

    @abstractmethod
    def send(self, command: ArrayLike) -> NDArray[np.floating[Any]]:
        """Reach velocities linearly over one period, inside the limits; return what was sent, (n + h,).

        Args:
            command: velocities at the end of the period [m/s, rad/s] and grippers (1 closed), (n + h,);
                one of another size, or that is not finite, brakes.
        """

    def stop(self) -> None:
        """Come to rest as fast as the limits allow, and stay there; grippers stay as they are."""
        while self.state().commanded.any():
            self.send(())

    def checkpoint(self) -> object:
        """Return the whole state, robot and things, to come back to; None where there is no way back."""
        return None

    def restore(self, checkpoint: Any) -> None:
        """Come back to a state: from there all goes on as it did."""
        raise HandrailError("a robot that is no simulation cannot be put back to where it was")

    def pictures(self, cameras: tuple[str, ...], size: tuple[int, int]) -> Mapping[str, NDArray[np.uint8]]:
        """Return what cameras of its own see, (height, width, 3) each, in a size (height, width) [px]."""
        raise HandrailError("a simulation is drawn, it has no cameras of its own")

    @property
    def time(self) -> float:
        """Since the episode began [s]."""
        return self.state().time

    @property
    @abstractmethod
    def openings(self) -> tuple[float, ...]:
        """How far grippers are open, from 0 to 1; 0 of a hand without one."""

    @property
    @abstractmethod
    def contacts(self) -> tuple[str, ...]:
        """The forbidden contacts in the last period."""

    @property
    def tools(self) -> tuple[Pose, ...]:
        """The poses of the tool points."""
        q = self.state().q
        return tuple(self._model.pose(q, hand.named("tool")) for hand in self._model.description.hands)

    def obstacles(self) -> tuple[Obstacle, ...]:
        """Return what a controller has to avoid besides the floor, where it is now, what is held among it."""
        return (*self._scene.obstacles(self.time), *self.held())

    def held(self) -> tuple[Obstacle, ...]:
        """Return what the fingers hold, fixed to its hand's tool as it is now."""
        return ()

    def poses(self) -> Mapping[str, Pose]:
        """Return where every scene object is now, by name."""
        time = self.time
        return {
            item.name: Pose(item.patrol.position(time) if item.patrol else item.position, item.rotation)
            for item in self._scene.objects
        }

    def still(self) -> frozenset[str]:
        """Return the names of the movable objects that are at rest: slower than 2 cm/s and 0.2 rad/s."""
        return frozenset()


class Gate:
    """Keeps what a robot is sent inside its limits, and remembers it; a robot has one.

    Args:
        model: of the robot.
        period: from one command to the next [s].
        grippers: at the beginning, 0 open, 1 closed; all open by default.
        precision: of the numbers that are sent; those of a dataset by default, so that it replays exactly.

    Attributes:
        velocity: sent last, (n,) [m/s, rad/s].
        grippers: sent last.
    """

    def __init__(
        self,
        model: RobotModel,
        period: float,
        grippers: tuple[float, ...] = (),
        precision: DTypeLike = np.float32,
    ) -> None:
        self._limiter = Limiter(model.description)
        self._period, self._precision = period, precision
        self.velocity = np.zeros(model.size)
        self.grippers = grippers or (0.0,) * len(model.description.hands)

    def limit(self, command: ArrayLike, q: FloatArray) -> NDArray[np.floating]:
        """Return what is sent instead of a command, (n + h,): velocities at the end of a period, grippers.

        A command of another size, or with a number that is not finite, brakes.

        Args:
            command: velocities [m/s, rad/s] and grippers, (n + h,).
            q: where the robot is, (n,).
        """
        said, n = np.asarray(command, dtype=np.float64).ravel(), len(self.velocity)
        usable = len(said) == n + len(self.grippers) and all(map(math.isfinite, said))
        if usable:
            self.grippers = closed(tuple(said[n:].tolist()), len(self.grippers))
        velocity, _ = self._limiter.limit(self.velocity, said[: n if usable else 0], self._period, q)
        sent = np.empty(n + len(self.grippers), self._precision)
        sent[:n], sent[n:] = velocity, self.grippers
        self.velocity = sent[:n].astype(np.float64)
        return sent

    def state(self) -> tuple[FloatArray, tuple[float, ...]]:
        """Return what was sent last, to come back to."""
        return self.velocity.copy(), self.grippers

    def restore(self, state: tuple[FloatArray, tuple[float, ...]]) -> None:
        """Come back to a state."""
        self.velocity, self.grippers = state[0].copy(), state[1]
