"""A robot behind its LeRobot client, in a world of which nobody tells the truth; a robot and a world."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handrail.collect.config import RecordConfig
from handrail.collect.lekiwi.link import Link, connect
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.session.build import build_env
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.plant import Plant
from handrail.collect.world.scene import Scene
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.model import RobotModel, load_model
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

    Every period `link.asked` whether it may go on.
    """
    description = link.model.description
    base, channels = len(description.base.joints), Channels.of(description)
    mpc = MaskedMpc(link.model)
    mpc.reset(() if base else obstacles)  # where a base stands is not known yet
    mask, values = channels.mask("joint"), np.zeros(channels.size)
    calm = stuck = 0
    nearest = np.inf
    for _ in range(round(_PATIENCE / link.period)):
        while (event := link.asked()) is EpisodeEvent.PAUSE:
            link.exchange(())
        if event is EpisodeEvent.QUIT:
            return
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


def open_client(config: RecordConfig) -> tuple[HandrailEnv, Link]:
    """Return the environment of a recording's robot, and the link to it."""
    fps = config.robot_fps or config.dataset.fps

    def plant(model: RobotModel, scene: Scene, q: FloatArray, period: float, **looks: Any) -> ClientPlant:
        return ClientPlant(model, scene, q, link, env.np_random_seed)

    link = connect(config.robot_client, config.client, config.camera_names, load_model(config.robot), fps)
    try:
        env = build_env(config, config.dataset.fps, plant=plant)
    except BaseException:
        link.close()
        raise
    return env, link


class ClientPlant(Plant):
    """Drives a robot in real time; it begins with the arm where the task has it, the base where it stands.

    Where the base stands is taken for where the task has put it. Things are taken to be where the task has
    put them. Shapes that overlap count as contacts.

    Args:
        model: of the robot.
        scene: what stands around it.
        q: where it begins, (n,).
        link: to it.
        seed: of the episode.
    """

    def __init__(self, model: RobotModel, scene: Scene, q: FloatArray, link: Link, seed: int) -> None:
        super().__init__(model, scene)
        self._link = link
        self._collision = CollisionModel(model, scene.obstacles())
        link.begin(seed)
        bring_home(link, q, scene.obstacles())
        link.body.place(q[: len(model.description.base.joints)])
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
        """Brake until it was sent rest."""
        self._link.stop()

    def pictures(self, cameras: tuple[str, ...], size: tuple[int, int]) -> Mapping[str, NDArray[np.uint8]]:
        """Return what its cameras see, (height, width, 3) each."""
        return self._link.pictures(cameras, size)

    @property
    def openings(self) -> tuple[float, ...]:
        """How far the gripper is open, from 0 to 1."""
        return tuple(self._link.body.openings.tolist())

    @property
    def contacts(self) -> tuple[str, ...]:
        """The pairs of shapes that overlap now, as far as is known."""
        distances = self._collision.values(self._link.state.q[None])[0]
        return tuple(" – ".join(self._collision.pairs[index]) for index in np.flatnonzero(distances < 0.0))
