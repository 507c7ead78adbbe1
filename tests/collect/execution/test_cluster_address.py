"""An address where something else listens is refused at once; Ray would try for a quarter of an hour."""

import socket
import threading
import time

import pytest

from handrail.controllers.errors import HandrailError

cluster = pytest.importorskip(
    "handrail.collect.execution.cluster", reason="needs Ray: pip install '.[cluster]'"
)


@pytest.mark.parametrize(
    ("answer", "words"),
    [(b"", "timed out"), (b"HTTP/1.1 400 Bad Request\r\n\r\n", "something else listens there, it answered")],
)
def test_something_else_at_the_address_is_one_line(answer, words, monkeypatch):
    monkeypatch.setattr(cluster, "PATIENCE", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as server:
        lines = []

        def serve():
            line, _ = server.accept()
            lines.append(line)
            line.sendall(answer)

        threading.Thread(target=serve, daemon=True).start()
        address, start = f"127.0.0.1:{server.getsockname()[1]}", time.monotonic()
        with pytest.raises(HandrailError, match=words) as found:
            cluster.Cluster(address)
        assert time.monotonic() - start < 20
        assert f"--ray {address}: expected a running cluster (`ray start --head`), got" in str(found.value)
        for line in lines:
            line.close()
