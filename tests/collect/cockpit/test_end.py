"""The law of the end: a page is told that there is nothing to come back to, before its server goes."""

import os
import signal
import threading

from cockpit_helpers import page, server, told

from handrail.collect.cockpit.pipe import Kind


def test_a_server_that_lags_tells_it_too():
    with server() as served, page(served) as socket:
        told(socket, "you")
        os.kill(served.process.pid, signal.SIGSTOP)
        while served.pipe.send(Kind.FRAME, {"stamp": 0.0}):
            pass
        served.pipe.send_surely(Kind.OVER, {"saved": 2})
        threading.Timer(0.3, os.kill, (served.process.pid, signal.SIGCONT)).start()
        served.close()
        assert told(socket, "over")["over"] == {"saved": 2}
