"""The law of the end: a page is told that there is nothing to come back to, before its server goes."""

import json

from cockpit_helpers import page, server, told

from handrail.collect.cockpit.pipe import OVER


def test_pages_hear_that_it_is_over_before_the_server_goes():
    with server() as served, page(served) as socket:
        told(socket, "you")
        served.send_surely(OVER, json.dumps({"saved": 2}).encode())
        served.close()
        assert told(socket, "over")["over"] == {"saved": 2}
