"""What a session asks of a robot and of the world around it: behind these stands MuJoCo, or anything else."""

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handrail.controllers.interface.controller import State
from handrail.controllers.robot.model import Pose
from handrail.controllers.robot.shape import Obstacle


class Robot(Protocol):
    """Follows velocities, one command a period; the one owner of what it was sent last."""

    def state(self) -> State:
        """Return the measured positions, velocities and time, and the velocity that was sent last."""
        ...

    def send(self, command: ArrayLike) -> NDArray[np.floating[Any]]:
        """Reach velocities linearly over one period, inside the limits; return what was sent, (n + 1,).

        Args:
            command: velocities at the end of the period [m/s, rad/s] and gripper (1 closed), (n + 1,); one
                of another size, or that is not finite, brakes.
        """
        ...

    def stop(self) -> None:
        """Come to rest as fast as the limits allow, and stay there; the gripper stays as it is."""
        ...


class World(Protocol):
    """What is around the robot, and the truth by which a task judges."""

    def checkpoint(self) -> object:
        """Return the whole state, robot and things, to come back to."""
        ...

    def restore(self, checkpoint: Any) -> None:
        """Come back to a state: from there all goes on as it did."""
        ...

    @property
    def time(self) -> float:
        """Since the episode began [s]."""
        ...

    @property
    def tool(self) -> Pose:
        """The pose of the tool point."""
        ...

    @property
    def opening(self) -> float:
        """How far the gripper is open, from 0 to 1."""
        ...

    @property
    def contacts(self) -> tuple[str, ...]:
        """The forbidden contacts in the last period."""
        ...

    @property
    def is_stable(self) -> bool:
        """Whether the physics went well so far."""
        ...

    def obstacles(self) -> tuple[Obstacle, ...]:
        """Return what a controller has to avoid besides the floor, where it is now, what is held among it."""
        ...

    def held(self) -> tuple[Obstacle, ...]:
        """Return what the fingers hold, fixed to the tool as it is now."""
        ...

    def poses(self) -> Mapping[str, Pose]:
        """Return where every scene object is now, by name."""
        ...

    def still(self) -> frozenset[str]:
        """Return the names of the movable objects that are at rest: slower than 2 cm/s and 0.2 rad/s."""
        ...


@runtime_checkable
class Seeing(Protocol):
    """A plant with cameras of its own; nobody has to draw what they see."""

    def pictures(self, cameras: tuple[str, ...], size: tuple[int, int]) -> Mapping[str, NDArray[np.uint8]]:
        """Return what cameras see, (height, width, 3) each, in a size (height, width) [px]."""
        ...


class Plant(Robot, World, Protocol):
    """A robot and its world in one, as a simulation has them."""
