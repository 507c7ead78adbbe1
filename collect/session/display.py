"""Shows a session in rerun, to a viewer or into a file."""

import contextlib
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from handrail.collect.session.outcome import Outcome
from handrail.collect.session.viewer import Viewer
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.errors import HandrailError, message_of, not_installed
from handrail.controllers.interface.channel_matrix import channel_matrix
from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.shape import Obstacle
from handrail.datasets.recording.frames import Frame

_PERIOD = 0.2  # between two transfers to the viewer [s]
_PATIENCE = 10.0  # with rerun's own writing [s]


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


class Display:
    """Sends every moment to rerun; an observer that never stops a session.

    Args:
        spawn: open the viewer in a window.
        web: serve the viewer to browsers of this machine instead.
        save: also or only write to this .rrd file; empty for none.
        say: is told where the web viewer is, and what goes wrong later.
    """

    def __init__(
        self, spawn: bool = False, web: bool = False, save: str = "", say: Callable[[str], None] = print
    ) -> None:
        try:
            import rerun as rr
        except ImportError as error:
            raise not_installed("--display_data, _web, _save", "rerun", "display") from error
        self._rr, self._save, self._say = rr, save, say
        self._viewer: Viewer | None = None
        self._stream: Any = None
        self._off, self._sent = False, 0.0
        self._drawing = Drawing(rr)
        rr.init("handrail")
        if save:
            rr.save(save)
        if spawn or web:
            self._open_viewer(web)

    def _open_viewer(self, web: bool) -> None:
        """Open a viewer on a stream in memory, beside the file if there is one."""
        rr = self._rr
        self._stream = rr.binary_stream()
        if self._save:
            rr.set_sinks(rr.FileSink(self._save), self._stream)
        rr.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        try:
            self._viewer = Viewer(self._read(), web)
        except (HandrailError, OSError) as error:
            flag, instead = "--display_data", "--display_web (in a browser) or --display_save FILE.rrd"
            if web:
                flag, instead = "--display_web", "--display_save FILE.rrd"
            raise HandrailError(f"{flag}: {error}; say {instead} instead") from error
        if web:
            self._say(f"Watch while it records: {self._viewer.address}")

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Draw the scene of a new episode."""
        self._attempt(lambda: self._drawing.begin(env))

    def see(self, frame: Frame) -> None:
        """Log one moment."""
        self._attempt(lambda: self._drawing.see(frame))
        if time.monotonic() > self._sent + _PERIOD:
            self._attempt(self._pass_on)

    def end(self, outcome: Outcome) -> None:
        """Log how the episode went."""
        self._attempt(lambda: self._drawing.end(outcome))

    def close(self) -> None:
        """Write out what is still buffered."""
        self._attempt(self._pass_on)
        if self._viewer:
            self._viewer.drain()
            self._viewer.close()
        recording = self._rr.get_global_data_recording()
        with contextlib.suppress(RuntimeError):  # what cannot be written now never will be
            recording.flush(timeout_sec=_PATIENCE)
            recording.disconnect()

    def _attempt(self, step: Callable[[], None]) -> None:
        """Do what must not cost the recording whatever goes wrong; say once that it did, and do no more."""
        if self._off:
            return
        try:
            step()
        except Exception as error:
            self._off = True
            self._complain(error)

    def _pass_on(self) -> None:
        """Let the viewer have what is new; go on without it if it fails and there is a file."""
        self._sent = time.monotonic()
        data = self._read() if self._stream else b""
        if not self._viewer:
            return
        try:
            self._viewer.send(data)
        except HandrailError as error:
            self._viewer.close()
            self._viewer, self._off = None, not self._save
            self._complain(error)

    def _complain(self, error: Exception) -> None:
        self._say(f"display: {message_of(error)}; the recording goes on")

    def _read(self) -> bytes:
        return self._stream.read(flush=True, flush_timeout_sec=_PATIENCE) or b""
