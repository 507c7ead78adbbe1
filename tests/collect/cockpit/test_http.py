"""Laws of connections without a token: few stay, whatever they do; pages are served all the same."""

import socket as sockets
import time
from contextlib import ExitStack
from urllib.parse import urlsplit

import pytest
from cockpit_helpers import TRUSTING, ask, ask_for, heard, page, server, stage

from handrail.collect.cockpit.pipe import Kind

pytestmark = pytest.mark.slow
STRANGERS = 300


@pytest.fixture(params=["127.0.0.1", "127.0.0.2"])
def opened(request, tmp_path, monkeypatch):
    """A server by HTTP or HTTPS, its owner's page, and a function that connects a stranger."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    with server(host=request.param) as served, ExitStack() as stack:
        place = urlsplit(served.address)
        token = place.fragment.encode()
        cookie = ask(served, "/login", token)[1]["set-cookie"].split(";")[0] if token else ""
        stage(served)
        owner = stack.enter_context(page(served, "the-owners-page", cookie=cookie))

        def stranger(agrees):
            plain = sockets.create_connection((place.hostname, place.port), timeout=30)
            wraps = agrees and place.scheme == "https"
            return stack.enter_context(TRUSTING.wrap_socket(plain) if wraps else plain)

        yield served, owner, stranger


def is_served(served, owner):
    """Whether a stop arrives at once, and a page is to be had."""
    before = time.monotonic()
    owner.send(ask_for("stop", True))
    assert heard(served, {Kind.STOP})
    assert time.monotonic() - before < 2.0
    assert ask(served, "/")[0] == 200
    return True


def heard_by(stranger):
    """Return how much is there to read until the connection ends [bytes]."""
    total = 0
    try:
        while more := len(stranger.recv(2**16)):
            total += more
    except ConnectionError:
        pass
    return total


def test_a_connection_that_asks_nothing_is_cut(opened):
    served, owner, stranger = opened
    silent = [stranger(agrees=False) for _ in range(STRANGERS)]
    silent[-1].send(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: ")
    assert is_served(served, owner)
    assert not any(map(heard_by, silent))


def test_of_connections_that_read_nothing_the_oldest_is_cut(opened):
    served, owner, stranger = opened
    much = f"GET /style.css HTTP/1.1\r\nHost: {urlsplit(served.address).netloc}\r\n\r\n".encode() * 400
    deaf = []
    for _ in range(STRANGERS):
        deaf.append(stranger(agrees=True))
        deaf[-1].sendall(much)
    assert is_served(served, owner)
    assert heard_by(deaf[0]) < heard_by(deaf[-1])
