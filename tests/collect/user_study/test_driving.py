"""A law of a study's trials: a STOP holds until somebody releases it, in the next mode too."""

from collections import Counter

from user_study_helpers import study_folder

from handrail.collect.cockpit.pipe import Kind
from handrail.collect.user_study.driving import Driving
from handrail.collect.user_study.plan import Step
from handrail.controllers.interrupts import Interrupts


class StoppingServer:
    """Passes on a STOP, and then that the trial has failed."""

    def __init__(self):
        self.pipe, self.dropped, self.unread = self, Counter(), [(Kind.STOP, None)]

    def receive(self):
        messages, self.unread = self.unread, []
        return messages or [(Kind.STILL, {"what": "failure", "value": True})]

    def send(self, *message, **more):
        pass

    send_surely = keep = drop = send


def test_a_stop_holds_in_the_next_mode(tmp_path):
    server, folder = StoppingServer(), study_folder(tmp_path)
    with Interrupts() as interrupts, Driving(folder, "P001", server, interrupts) as driving:
        driving.prepare("ee", "reach")
        driving.run(Step("practice", "ee", "reach"), 3)
        assert not server.unread
        driving.prepare("direct", "reach")
        assert server.unread == [(Kind.STOP, None)]
