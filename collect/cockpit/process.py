"""The web server's process: started, told where to listen, started again when it dies, ended."""

import json
import os
import secrets
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import webbrowser
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

from handrail.collect.cockpit.pipe import Kind, Message, Pipe
from handrail.collect.cockpit_config import CockpitConfig
from handrail.controllers.errors import HandrailError

_BEGIN, _LAST_WORDS, _END = 30.0, 1.0, 5.0  # patience [s]
MOST_DEATHS, _WITHIN = 3, 60.0  # of the server, in a time [s]


class ServerProcess:
    """Serves the page in a process of its own.

    If it dies, whoever drives is lost (the robot brakes), and another one begins at the same address with the
    same token; the recording never waits for it.

    Args:
        config: where it listens.
        say: is told when it dies.

    Attributes:
        process: of the server that runs now.
        pipe: to it.
        unread: messages that it has passed on, and nobody has obeyed yet.
        address: of the page; with the token after `#` where one is asked for.
    """

    def __init__(self, config: CockpitConfig, say: Callable[[str], None] = lambda words: None) -> None:
        config.check()
        self._folder = tempfile.TemporaryDirectory(prefix="handrail-cockpit-", ignore_cleanup_errors=True)
        self._settings = asdict(config) | {"folder": self._folder.name, "secret": secrets.token_urlsafe(32)}
        self._say, self._deaths = say, deque[float](maxlen=MOST_DEATHS)
        self.unread: list[Message] = []
        self.address = ""
        self._start()
        try:
            self._wait()
        except BaseException:
            self.close()
            raise

    def keep(self, name: str, data: bytes) -> None:
        """Let the server have a file, once."""
        path = Path(self._folder.name) / name
        if not path.exists():
            path.write_bytes(data)

    def drop(self, name: str) -> None:
        """Take a file away from the server."""
        (Path(self._folder.name) / name).unlink(missing_ok=True)

    def receive(self) -> list[Message]:
        """Return what the server has passed on: `LOST` when it died, `NOTE` when another one has begun."""
        try:
            messages = self.pipe.receive()
            self.pipe.flush()
        except HandrailError:
            self._start_again()
            messages = [(Kind.LOST, None)]
        messages, self.unread = self.unread + messages, []
        for kind, value in messages:
            if kind is Kind.NOTE:
                self._take(**value)
        return messages

    def close(self) -> None:
        """Let the server have what waits for it, and end it: it tells its pages, then goes by itself."""
        until = time.monotonic() + _LAST_WORDS
        while not self.pipe.flush() and time.monotonic() < until:
            time.sleep(0.01)
        self.pipe.close()
        self._end(_END)
        self._folder.cleanup()

    def _start(self) -> None:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "handrail.collect.cockpit.server", str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                start_new_session=True,  # Ctrl-C ends the recording, which ends the server
                stdin=subprocess.PIPE,
            )
        self.pipe = Pipe(ours)
        assert self.process.stdin
        with suppress(BrokenPipeError), self.process.stdin as settings:
            settings.write(json.dumps(self._settings).encode())

    def _start_again(self) -> None:
        """Start another server instead of one that has died."""
        self.pipe.close()
        code, now = self._end(0.1), time.monotonic()
        how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        if len(self._deaths) == MOST_DEATHS and now < self._deaths[0] + _WITHIN:
            raise HandrailError(
                f"cockpit: the web server ended {MOST_DEATHS + 1} times within {_WITHIN:.0f} s, "
                f"at last {how}; the saved episodes are whole"
            )
        self._deaths.append(now)
        self._say(f"The page's web server ended ({how}). The robot brakes; a new server starts.")
        self._start()

    def _end(self, patience: float) -> int:
        """Wait for the server's end, then kill it; return its exit code."""
        try:
            return self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()

    def _take(self, address: str = "", port: int = 0, error: str = "") -> None:
        """Take where the server listens."""
        if error:
            raise HandrailError(error)
        if self.address and self.address != address:
            self._say(f"Drive at {address}")
        self.address, self._settings["port"] = address, port

    def _wait(self) -> None:
        until = time.monotonic() + _BEGIN
        while not self.address:
            if time.monotonic() > until:
                raise HandrailError(f"cockpit: the web server did not start within {_BEGIN:.0f} s")
            time.sleep(0.02)
            for kind, value in self.pipe.receive():
                if kind is Kind.NOTE:
                    self._take(**value)
                else:
                    self.unread.append((kind, value))


def open_server(config: CockpitConfig, say: Callable[[str], None]) -> ServerProcess:
    """Return a server; say where its page is, and open it where the settings want that."""
    server = ServerProcess(config, say)
    say(f"Drive at {server.address}")
    shows = sys.platform != "linux" or {"DISPLAY", "WAYLAND_DISPLAY", "BROWSER"} & os.environ.keys()
    if config.open and shows and not config.asks:  # other accounts could read a token on a command line
        threading.Thread(target=webbrowser.open, args=(server.address,), daemon=True).start()
    return server
