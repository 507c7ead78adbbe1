"""Shows a session in rerun, to a viewer or into a file."""

import contextlib
import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from handrail.collect.session.outcome import Outcome
from handrail.collect.session.viewer import Viewer
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.errors import HandrailError, imported, message_of
from handrail.controllers.interface.channel_matrix import channel_matrix
from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.shape import Obstacle
from handrail.datasets.recording.frames import Frame

_PERIOD = 0.2  # between two transfers to the viewer [s]
_PATIENCE = 10.0  # with rerun's own writing [s]


_ROBOT, _SCENE = (235, 190, 40), (150, 160, 170)


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
        rr, self._env, self._time = self._rr, env, 0.0
        self._episode += 1
        rr.set_time("episode", sequence=self._episode)
        rr.set_time("time", duration=0.0)
        rr.log("world", rr.Clear(recursive=True))
        rr.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        for obstacle in env.start.scene.obstacles():
            self._log_shape(f"world/scene/{obstacle.name}", obstacle)

    def see(self, frame: Frame) -> None:
        """Log one moment."""
        rr, model, diagnostics = self._rr, self._env.model, frame.diagnostics
        time, self._time = self._time, self._env.plant.time
        rr.set_time("time", duration=time)
        for mover in self._env.start.scene.movers:
            self._log_shape(f"world/scene/{mover.name}", mover.obstacle(time))
        q, v = frame.state[: 2 * model.size].astype(float).reshape(2, -1)
        self._log_robot(q)
        for name, image in frame.images.items():
            rr.log(f"camera/{name}", rr.Image(image))
        numbers = self._motion(frame, q, v) | {
            "distance/smallest": _finite(diagnostics.smallest_distance),
            "distance/work": _finite(diagnostics.work_distance),
            "controller/solve_time_ms": 1e3 * diagnostics.solve_time,
            "controller/slack": diagnostics.slack,
        }
        for path, number in numbers.items():
            rr.log(path, rr.Scalars(number))
        rr.log("controller/status", rr.TextLog(f"{frame.intent.mode}: {diagnostics.status.value}"))

    def end(self, outcome: Outcome) -> None:
        """Log how the episode went."""
        said = "success" if outcome.success else f"failed: {outcome.failure_reason}"
        self._rr.log("controller/status", self._rr.TextLog(said if outcome.kept else "not kept"))

    def _log_robot(self, q: np.ndarray) -> None:
        """Draw the robot's collision shapes where they are."""
        model = self._env.model
        for placed in model.description.collision:
            pose = model.pose(q, placed.frame)
            position = pose.position + pose.rotation @ placed.placement.translation
            rotation = pose.rotation @ placed.placement.rotation
            shape = Obstacle(placed.name, placed.shape, position, rotation)
            self._log_shape(f"world/robot/{placed.name}", shape, _ROBOT)

    def _motion(self, frame: Frame, q: np.ndarray, v: np.ndarray) -> dict[str, float]:
        """Return what happens on each channel, and what is asked on those that are owned."""
        model, intent, numbers = self._env.model, frame.intent, dict[str, float]()
        channels = Channels.of(model.description)
        found = zip(intent.values, intent.mask, channel_matrix(model, channels, q) @ v, strict=True)
        for name, (asked, owned, real) in zip(channels.names, found, strict=True):
            numbers[f"motion/{name}/realised"] = real
            if owned and np.isfinite(asked):
                numbers[f"motion/{name}/asked"] = asked
        return numbers

    def _log_shape(self, path: str, thing: Obstacle, colour: tuple[int, int, int] = _SCENE) -> None:
        rr, size = self._rr, thing.shape.size
        round_about = {"radii": [size[0]], "lengths": [size[-1]], "colors": [colour]}
        rr.log(path, rr.Transform3D(translation=thing.position, mat3x3=thing.rotation))
        match thing.shape.kind:
            case "box":
                shape = rr.Boxes3D(half_sizes=[size / 2], colors=[colour])
            case "capsule":
                shape = rr.Capsules3D(translations=[[0, 0, -size[-1] / 2]], **round_about)
            case "cylinder":
                shape = rr.Cylinders3D(**round_about)
            case _:
                shape = rr.Ellipsoids3D(half_sizes=[[size[0]] * 3], colors=[colour])
        rr.log(path, shape)


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
        rr = imported("rerun", "--display_data, _web, _save", "rerun", "display")
        self._rr, self._save, self._say = rr, os.path.expanduser(save), say
        self._viewer: Viewer | None = None
        self._stream: Any = None
        self._off, self._sent = False, 0.0
        self._drawing = Drawing(rr)
        rr.init("handrail")
        if self._save:
            rr.save(self._save)
        if spawn or web:
            self._open_viewer(web)

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

    def _open_viewer(self, web: bool) -> None:
        """Open a viewer on a stream in memory, beside the file if there is one."""
        rr = self._rr
        self._stream = rr.binary_stream()
        if self._save:
            rr.set_sinks(rr.FileSink(self._save), self._stream)
        rr.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        flag, others = "--display_data", "--display_web (in a browser) or "
        if web:
            flag, others = "--display_web", ""
        try:
            self._viewer = Viewer(self._read(), web)
        except (HandrailError, OSError) as error:
            raise HandrailError(f"{flag}: {error}; say {others}--display_save FILE.rrd instead") from error
        if web:
            self._say(f"Watch while it records: {self._viewer.address}")

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
        data = self._read() if self._stream else b""  # also where nobody takes it: else it piles up
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
