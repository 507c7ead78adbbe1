"""A page without a browser that watches a cockpit, and ends an episode when nobody else does."""

import itertools
import json
import socket
import threading
import time
from contextlib import contextmanager, suppress
from urllib.parse import urlsplit

import numpy as np
from cockpit_helpers import drive, page
from websockets.exceptions import ConnectionClosed

PATIENCE = 120.0  # [s]
_NAMES = itertools.count()


class Witness:
    """Watches; may drive when it is let."""

    def __init__(self, address):
        self.address, self._name = address, f"a-witness-{next(_NAMES)}"
        self.frame, self.you, self._ends = {}, {}, False
        self._socket, self._wants = None, False
        threading.Thread(target=self._watch, daemon=True).start()

    def make_ready(self):
        """Wait until the robot may be started; end what a law that failed has left."""
        if self.until(bool)["phase"] != "ready":
            self.end_episode()
        self.until(lambda frame: frame["phase"] == "ready")

    def _watch(self):
        while not self._ends:
            with (
                suppress(OSError, ConnectionClosed, TimeoutError, EOFError),
                page(self, self._name) as self._socket,
            ):
                for message in self._socket:
                    self._hear(message)
            time.sleep(0.2)

    def _hear(self, message):
        said = json.loads(message) if isinstance(message, str) else {}
        if said.get("kind") in ("frame", "you"):
            setattr(self, said["kind"], said.get("frame", said))
        if said.get("driving") and not self._wants:  # the first page that comes gets the lease
            self.say({"kind": "ask", "what": "give", "value": True})

    def until(self, holds):
        """Wait for a frame of which something holds."""
        end = time.monotonic() + PATIENCE
        while not (self.frame and holds(self.frame)):
            assert time.monotonic() < end, {name: self.frame.get(name) for name in ("phase", "v", "saved")}
            time.sleep(0.01)
        return self.frame

    def say(self, message):
        """Say something."""
        with suppress(ConnectionClosed, OSError):
            self._socket.send(json.dumps(message))

    def end_episode(self):
        """Take the lease, and call the episode a failure, which saves it; return its number."""
        saved, end = self.frame["saved"], time.monotonic() + PATIENCE
        self._wants = True
        while self.frame["saved"] == saved:
            assert time.monotonic() < end, self.you
            driving = self.you.get("driving")
            self.say(json.loads(drive(time.monotonic_ns() // 1_000_000, self.frame["stamp"], on=False)))
            if driving and self.frame["phase"] == "stopped":
                self.say({"kind": "ask", "what": "stop", "value": False})
            self.say({"kind": "ask", "what": "failure" if driving else "take", "value": True})
            time.sleep(0.5)
        self._wants = False
        self.say({"kind": "ask", "what": "give", "value": True})
        while self.you["driving"]:
            time.sleep(0.05)
        self.until(lambda frame: frame["phase"] == "ready")
        return saved

    def close(self):
        """Go."""
        self._ends = True
        if self._socket:
            self._socket.close()


def is_moving(frame):
    """Whether the robot is commanded to move."""
    return np.abs(frame["v"]).max() > 0.02


def is_still(frame):
    """Whether it is commanded to stand still."""
    return not np.any(frame["v"])


class Relay:
    """Passes bytes on between a page and a cockpit, until the cable is cut."""

    def __init__(self, address):
        self._there = urlsplit(address).port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"http://127.0.0.1:{self._listener.getsockname()[1]}/"
        self._pairs, self.is_cut, self.most = [], False, 1e9  # bytes a second from the page
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        with suppress(OSError):
            while True:
                here, _ = self._listener.accept()
                there = socket.create_connection(("127.0.0.1", self._there))
                self._pairs.append((here, there))
                for ends in ((here, there, lambda: self.most), (there, here, lambda: 1e9)):
                    threading.Thread(target=self._pass, args=ends, daemon=True).start()

    def _pass(self, source, target, most):
        with suppress(OSError):
            while data := source.recv(65536 if most() > 65536 else 256):
                while self.is_cut:  # nothing passes, and nobody is told
                    time.sleep(0.05)
                target.sendall(data)
                time.sleep(len(data) / most())
            target.shutdown(socket.SHUT_WR)

    def break_off(self):
        """End all connections."""
        for each in itertools.chain.from_iterable(self._pairs):
            with suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()
        self._pairs.clear()

    def close(self):
        """End."""
        self.is_cut = False
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self.break_off()


@contextmanager
def closing(thing):
    """Close it at the end."""
    try:
        yield thing
    finally:
        thing.close()
