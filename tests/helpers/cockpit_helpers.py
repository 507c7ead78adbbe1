"""A server of the cockpit without a robot, and pages that are nothing but sockets."""

import json
import socket
import ssl
import time
import urllib.error
import urllib.request
from contextlib import contextmanager, suppress
from urllib.parse import urlsplit

from websockets.sync.client import connect
from websockets.typing import Origin

from handrail.collect.cockpit.pipe import Kind, Pipe
from handrail.collect.cockpit.process import ServerProcess
from handrail.collect.cockpit_config import CockpitConfig

TRUSTING = ssl.create_default_context()
TRUSTING.check_hostname, TRUSTING.verify_mode = False, ssl.CERT_NONE  # the certificate was made a moment ago


def connected():
    """Return the two ends of a connection."""
    return [Pipe(end) for end in socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)]


@contextmanager
def server(say=lambda words: None, **settings):
    """Run a server."""
    made = ServerProcess(CockpitConfig(port=0, open=False, **settings), say)
    try:
        yield made
    finally:
        made.close()


def page(served, name="a-page-of-its-own", origin="", cookie="", **options):
    """Return a socket as a page opens it."""
    parts = urlsplit(served.address)
    secure = parts.scheme == "https"
    headers = {"Cookie": cookie} if cookie else {}
    return connect(
        f"{'wss' if secure else 'ws'}://{parts.netloc}/drive?page={name}",
        origin=Origin(origin or f"{parts.scheme}://{parts.netloc}"),
        additional_headers=headers,
        ssl=TRUSTING if secure else None,
        compression=None,
        open_timeout=60,
        ping_interval=None,
        **options,
    )


def ask(served, path, data=None, **headers):
    """Return status and headers of a request."""
    parts = urlsplit(served.address)
    base = f"{parts.scheme}://{parts.netloc}"
    request = urllib.request.Request(base + path, data, {"Origin": base} | headers)
    try:
        with urllib.request.urlopen(request, timeout=60, context=TRUSTING) as answer:
            return answer.status, dict(answer.headers)
    except urllib.error.HTTPError as error:
        return error.code, dict(error.headers)


def drive(sequence=1, echo=None, axes=(0.0,) * 18, **changes):
    """Return a message of a page; one that answers this very moment, if it does not say which."""
    echo = time.monotonic() if echo is None else echo
    said = {"kind": "drive", "seq": sequence, "echo": echo, "on": True, "device": "keyboard"}
    return json.dumps({**said, "grips": [False], "axes": list(axes), "view": 0.0, "targets": [], **changes})


def show(served, **frame):
    """Let the recording show a frame, or what there is to draw."""
    served.pipe.send(Kind.FRAME, {"stamp": time.monotonic(), **frame})


def seen(served, socket, n):
    """Show a frame; return its time when a page has got it."""
    while True:
        show(served, n=n)  # again, where there was no room in the pipe
        with suppress(TimeoutError):
            while (frame := told(socket, "frame", 0.5)["frame"])["n"] != n:
                pass
            return frame["stamp"]


def stage(served):
    """Let the recording say what there is to draw."""
    served.pipe.send(Kind.STAGE, {"robot": "r"})


def heard(served, kinds, count=1, patience=60.0):
    """Return what reaches the recording of some kinds, as many as are wanted."""
    found, until = [], time.monotonic() + patience
    while len(found) < count and time.monotonic() < until:
        found += [(kind, data) for kind, data in served.receive() if kind in kinds]
        time.sleep(0.01)
    return found


def told(socket, kind, patience=60.0):
    """Return the next message of a kind that a page gets."""
    until = time.monotonic() + patience
    while time.monotonic() < until:
        said = json.loads(socket.recv(timeout=patience))
        if said["kind"] == kind:
            return said
    raise TimeoutError(kind)


def ask_for(what, value=True, **more):
    """Return a message of a page that asks for something once."""
    return json.dumps({"kind": "ask", "what": what, "value": value, **more})
