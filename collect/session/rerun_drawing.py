"""Draws a session in rerun: robot, scene, cameras, intent against motion, distances."""

from typing import Any

import numpy as np

from handrail.collect.envs.env import HandrailEnv
from handrail.collect.session.outcome import Outcome
from handrail.controllers.interface.channel_matrix import channel_matrix
from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.shape import Obstacle
from handrail.datasets.recording.frames import Frame

_ROBOT = (235, 190, 40)
_SCENE = (150, 160, 170)


class Drawing:
    """Logs every moment of a session.

    Args:
        rr: the module `rerun`.
    """

    def __init__(self, rr: Any) -> None:
        self._rr = rr
        self._episode = -1

    def begin(self, env: HandrailEnv) -> None:
        """Draw the scene of a new episode."""
        self._model = env.model
        self._channels = Channels.of(env.model.description)
        self._world, self._time = env.world, 0.0
        self._episode += 1
        rr = self._rr
        rr.set_time("episode", sequence=self._episode)
        rr.set_time("time", duration=0.0)
        rr.log("world", rr.Clear(recursive=True))
        rr.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        self._movers = env.start.scene.movers
        for obstacle in env.start.scene.obstacles():
            self._log_shape(f"world/scene/{obstacle.name}", obstacle)

    def see(self, frame: Frame) -> None:
        """Log one moment."""
        rr = self._rr
        time, self._time = self._time, self._world.time
        rr.set_time("time", duration=time)
        for mover in self._movers:
            self._log_shape(f"world/scene/{mover.name}", mover.obstacle(time))
        q = frame.state[: self._model.size].astype(float)
        v = frame.state[self._model.size : 2 * self._model.size].astype(float)
        self._log_robot(q)
        self._log_tracking(frame, q, v)
        for name, image in frame.images.items():
            rr.log(f"camera/{name}", rr.Image(image))
        diagnostics = frame.diagnostics
        rr.log("distance/smallest", rr.Scalars(_finite(diagnostics.smallest_distance)))
        rr.log("distance/work", rr.Scalars(_finite(diagnostics.work_distance)))
        rr.log("controller/solve_time_ms", rr.Scalars(1e3 * diagnostics.solve_time))
        rr.log("controller/slack", rr.Scalars(diagnostics.slack))
        rr.log("controller/status", rr.TextLog(f"{frame.intent.mode}: {diagnostics.status.value}"))

    def end(self, outcome: Outcome) -> None:
        """Log how the episode went."""
        said = "success" if outcome.success else f"failed: {outcome.failure_reason}"
        self._rr.log("controller/status", self._rr.TextLog(said if outcome.kept else "not kept"))

    def _log_robot(self, q: np.ndarray) -> None:
        """Draw the robot's collision shapes where they are."""
        for placed in self._model.description.collision:
            pose = self._model.pose(q, placed.frame)
            position = pose.position + pose.rotation @ placed.placement.translation
            rotation = pose.rotation @ placed.placement.rotation
            shape = Obstacle(placed.name, placed.shape, position, rotation)
            self._log_shape(f"world/robot/{placed.name}", shape, _ROBOT)

    def _log_tracking(self, frame: Frame, q: np.ndarray, v: np.ndarray) -> None:
        """Plot what is asked on each owned channel against what happens."""
        rr, channels = self._rr, self._channels
        realised = channel_matrix(self._model, channels, q) @ v
        for name, asked, owned, real in zip(
            channels.names, frame.intent.values, frame.intent.mask, realised, strict=True
        ):
            rr.log(f"motion/{name}/realised", rr.Scalars(real))
            if owned and np.isfinite(asked):
                rr.log(f"motion/{name}/asked", rr.Scalars(asked))

    def _log_shape(self, path: str, thing: Obstacle, colour: tuple[int, int, int] = _SCENE) -> None:
        rr, size = self._rr, thing.shape.size
        self._rr.log(path, rr.Transform3D(translation=thing.position, mat3x3=thing.rotation))
        shapes = {
            "box": lambda: rr.Boxes3D(half_sizes=[size / 2], colors=[colour]),
            "capsule": lambda: rr.Capsules3D(
                radii=[size[0]], lengths=[size[-1]], translations=[[0, 0, -size[-1] / 2]], colors=[colour]
            ),
            "cylinder": lambda: rr.Cylinders3D(radii=[size[0]], lengths=[size[-1]], colors=[colour]),
            "sphere": lambda: rr.Ellipsoids3D(half_sizes=[[size[0]] * 3], colors=[colour]),
        }
        rr.log(path, shapes[thing.shape.kind]())


def _finite(value: float) -> float:
    return value if np.isfinite(value) else np.nan
