"""A robot behind its LeRobot client, in a world of which nobody tells the truth; a robot and a world."""

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handrail.collect.lekiwi.homing import bring_home
from handrail.collect.lekiwi.link import Link
from handrail.collect.simulation.scene import Scene
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.controller import State
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Obstacle

_MOST_BRAKING = 200  # periods


class ClientPlant:
    """Drives a robot in real time; it begins with the arm where the task has it, the base where it stands.

    Where the base stands is taken for where the task has put it. Things are taken to be where the task has
    put them. Shapes that overlap count as contacts.

    Args:
        model: of the robot.
        scene: what stands around it.
        q: where it begins, (n,).
        link: to it.
        seed: of the episode.

    Raises:
        HandrailError: the arm does not come to where the episode begins.
    """

    is_stable = True

    def __init__(self, model: RobotModel, scene: Scene, q: FloatArray, link: Link, seed: int) -> None:
        self._model, self._scene, self._link = model, scene, link
        self._collision = CollisionModel(model, scene.obstacles())
        link.begin(seed)
        bring_home(link, q, scene.obstacles())
        link.body.place(q[: len(model.description.base_joints)])
        self._start = link.state.time
        link.exchange(())  # nothing usable: it stands

    def state(self) -> State:
        """Return where it is; the time stands still, and controllers brake, while nothing usable is heard."""
        now = self._link.state
        return replace(now, time=now.time - self._start)

    def send(self, command: ArrayLike) -> NDArray[np.floating[Any]]:
        """Send a command, and let the period pass; return what was sent."""
        return self._link.exchange(command)

    def stop(self) -> None:
        """Brake until it was sent rest, as long as it can be reached."""
        with contextlib.suppress(HandrailError):
            for _ in range(_MOST_BRAKING):
                if not self._link.body.velocity.any():
                    return
                self._link.exchange(())

    def checkpoint(self) -> object:
        """Return nothing: there is no way back."""
        return None

    def restore(self, checkpoint: Any) -> None:
        """Refuse.

        Raises:
            HandrailError: always.
        """
        raise HandrailError("a robot that is no simulation cannot be put back to where it was")

    def pictures(self, cameras: tuple[str, ...], size: tuple[int, int]) -> Mapping[str, NDArray[np.uint8]]:
        """Return what its cameras see, (height, width, 3) each."""
        return self._link.pictures(cameras, size)

    @property
    def time(self) -> float:
        """Since the episode began [s]."""
        return self.state().time

    @property
    def tool(self) -> Pose:
        """The pose of the tool point, by the measured joints and the odometry."""
        return self._model.pose(self._link.state.q)

    @property
    def opening(self) -> float:
        """How far the gripper is open, from 0 to 1."""
        return self._link.body.opening

    @property
    def contacts(self) -> tuple[str, ...]:
        """The pairs of shapes that overlap now, as far as is known."""
        distances = self._collision.values(self._link.state.q[None])[0]
        return tuple(" – ".join(self._collision.pairs[index]) for index in np.flatnonzero(distances < 0.0))

    def obstacles(self) -> tuple[Obstacle, ...]:
        """Return what stands around, where the task has put it."""
        return self._scene.obstacles(self.time)

    def held(self) -> tuple[Obstacle, ...]:
        """Return nothing: nobody knows."""
        return ()

    def poses(self) -> Mapping[str, Pose]:
        """Return where the task has put every scene object, by name."""
        return {item.name: Pose(item.position, item.rotation) for item in self._scene.objects}

    def still(self) -> frozenset[str]:
        """Return nothing: nobody knows."""
        return frozenset()


def plant_of(link: Link, seed: Callable[[], int]) -> Callable[..., ClientPlant]:
    """Return what makes the plant of an episode.

    Args:
        link: to the robot.
        seed: says that of the episode.
    """

    def build(model: RobotModel, scene: Scene, q: FloatArray, period: float, **looks: Any) -> ClientPlant:
        return ClientPlant(model, scene, q, link, seed())

    return build
