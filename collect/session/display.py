"""Shows a session in rerun, to a viewer or into a file."""

import contextlib
import time
from collections.abc import Callable
from typing import Any

from handrail.collect.envs.env import HandrailEnv
from handrail.collect.session.outcome import Outcome
from handrail.collect.session.rerun_drawing import Drawing
from handrail.collect.session.viewer import Viewer
from handrail.controllers.errors import HandrailError, message_of, not_installed
from handrail.datasets.recording.frames import Frame

_PERIOD = 0.2  # between two transfers to the viewer [s]
_PATIENCE = 10.0  # with rerun's own writing [s]


class Display:
    """Sends every moment to rerun; an observer that never stops a session.

    Args:
        spawn: open the viewer in a window.
        web: serve the viewer to browsers of this machine instead.
        save: also or only write to this .rrd file; empty for none.
        say: is told where the web viewer is, and what goes wrong later.

    Raises:
        HandrailError: rerun is not installed, or the viewer or the file cannot be opened.
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
