"""A rerun viewer in a process of its own, fed through a pipe: it may die or stall, and nobody waits for it.

rerun's own `spawn` waits for ever where no window opens, its `serve_grpc` and `serve_web_viewer` listen on
all addresses, and its connection stops the sender while the viewer stalls.
"""

import contextlib
import importlib.util
import os
import re
import select
import socket
import subprocess
import tempfile
import time
from pathlib import Path
from urllib.parse import quote

from handrail.controllers.errors import HandrailError

_HERE = "127.0.0.1"  # this machine and no other
_DATA_PORT, _PAGE_PORT = 9876, 9090  # rerun's own; others where these are taken
_BEGIN, _END = 30.0, 5.0  # patience [s]
MOST_WAITING = 2**26  # [bytes]
_PIECE = 2**16  # [bytes]
_GRACE = 0.5  # time in which the last data reach a browser [s]


class Viewer:
    """Shows a stream in rerun's format in a window, or to browsers of this machine.

    Args:
        first: beginning of the stream; a viewer begins when it has some.
        web: serve the web viewer instead of opening a window.

    Attributes:
        address: of the web viewer's page; empty for a window.
        process: rerun's.
    """

    def __init__(self, first: bytes, web: bool) -> None:
        self._web, self._waiting = web, bytearray(first)
        self._port, page = _free_port(_DATA_PORT), _free_port(_PAGE_PORT)
        data = quote(f"rerun+http://{_HERE}:{self._port}/proxy", safe="")
        self.address = f"http://{_HERE}:{page}/?url={data}" if web else ""
        served = ["--serve-web", "--web-viewer-port", str(page)] if web else []
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 (as long as the process)
        end, self._pipe = os.pipe()
        os.set_blocking(self._pipe, False)
        self.process = subprocess.Popen(
            [_program(), "--bind", _HERE, "--port", str(self._port), *served, "-"],
            stdin=end,
            stdout=self._said,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # Ctrl-C ends the recording; the window stays
        )
        os.close(end)
        try:
            self._begin()
        except BaseException:
            self._kill()
            self.close()
            raise

    def send(self, data: bytes) -> None:
        """Pass data on, as much as the viewer takes now; the rest waits."""
        self._waiting += data
        try:
            while self._waiting:
                del self._waiting[: os.write(self._pipe, self._waiting[:_PIECE])]
        except BlockingIOError:
            if len(self._waiting) > MOST_WAITING:
                raise HandrailError("the viewer does not keep up") from None
        except BrokenPipeError:
            raise HandrailError("the viewer has ended") from None

    def drain(self) -> None:
        """Give the viewer a few seconds to take what still waits."""
        until = time.monotonic() + _END
        with contextlib.suppress(HandrailError):  # nobody is there to take it
            while self._waiting and (left := until - time.monotonic()) > 0.0:
                select.select([], [self._pipe], [], left)
                self.send(b"")
        if self._web:
            time.sleep(_GRACE)

    def close(self) -> None:
        """End the stream: a window stays open, a web viewer ends."""
        if self._web:
            self._kill()
        os.close(self._pipe)
        self._said.close()

    def _begin(self) -> None:
        """Wait until the viewer listens."""
        until, trouble = time.monotonic() + _BEGIN, ""
        while not trouble and not _listens(self._port):
            if self.process.poll() is not None:
                trouble = f": {self._last_words()}"
            elif time.monotonic() > until:
                trouble = f" within {_BEGIN:.0f} s"
            with contextlib.suppress(HandrailError):  # it has ended: why is said next time
                self.send(b"")
            time.sleep(0.05)
        if trouble:
            raise HandrailError(f"the rerun viewer did not start{trouble}")

    def _last_words(self) -> str:
        self._said.seek(0)
        lines = self._said.read().decode(errors="replace").strip().splitlines()
        last = lines[-1].rstrip(".") if lines else f"exit code {self.process.returncode}"
        return re.sub(r"^Error: (.*\.rs:\d+: )?", "", last)  # without the place in rerun's source

    def _kill(self) -> None:
        self.process.kill()
        self.process.wait()


def _program() -> str:
    """Return rerun's program itself: its Python wrapper would outlive a kill."""
    found = importlib.util.find_spec("rerun_cli")
    if found is None or found.origin is None:
        raise HandrailError("the rerun viewer did not start: expected the package rerun_cli, found none")
    return str(Path(found.origin).parent / "rerun")


def _free_port(wanted: int) -> int:
    """Return a port that nobody listens on: the one wanted, if it can be."""
    for port in (wanted, 0):
        with contextlib.suppress(OSError), socket.create_server((_HERE, port)) as trial:
            return trial.getsockname()[1]
    raise HandrailError(f"the rerun viewer did not start: no free port on {_HERE}")


def _listens(port: int) -> bool:
    with contextlib.suppress(OSError), socket.create_connection((_HERE, port), timeout=1.0):
        return True
    return False
