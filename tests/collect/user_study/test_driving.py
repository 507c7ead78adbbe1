"""Laws of a study's trials: a STOP holds in the next mode too; keys are said to who knows the robot."""

from collections import Counter

import pytest
from user_study_helpers import study_folder

from handrail.collect.cockpit.pipe import Kind
from handrail.collect.user_study.driving import Driving
from handrail.collect.user_study.plan import Step
from handrail.controllers.interrupts import Interrupts


class StoppingServer:
    """Once the trial is there passes on a Start, a STOP, and then that it has failed."""

    def __init__(self, *asks):
        asked = [{"what": what, "value": value} for what, value in (*asks, ("start", True))]
        self.unread = [*((Kind.ASK, each) for each in asked), (Kind.STOP, None)]
        self.pipe, self.dropped = self, Counter()
        self.sent, self.asked = [], 0

    def receive(self):
        self.asked += 1
        if self.asked == 1:  # while the trial is made
            return []
        messages, self.unread = self.unread[:1], self.unread[1:]  # one a period
        return messages or [(Kind.STILL, {"what": "failure", "value": True})]

    def send(self, *message, **more):
        pass

    def send_surely(self, kind, *message, **more):
        self.sent.append(kind)

    keep = drop = send


class SeenDriving(Driving):
    """Shows the person at its cockpit."""

    @property
    def person(self):
        return self._cockpit.person


def test_a_stop_holds_in_the_next_mode(tmp_path):
    server, folder = StoppingServer(), study_folder(tmp_path)
    with Interrupts() as interrupts, Driving(folder, "P001", server, interrupts) as driving:
        driving.prepare("ee", "reach")
        driving.run(Step("practice", "ee", "reach"), 3)
        assert not server.unread
        driving.prepare("direct", "reach")
        assert server.unread == [(Kind.STOP, None)]


def test_the_page_knows_the_robot_before_a_card_says_its_keys(tmp_path):
    server, folder = StoppingServer(), study_folder(tmp_path)
    with Interrupts() as interrupts, Driving(folder, "P001", server, interrupts) as driving:
        driving.prepare("ee", "reach")
        assert Kind.STAGE in server.sent


@pytest.mark.parametrize("allow", [[], ["mask"]])
@pytest.mark.parametrize("what", ["mask", "lock"])
def test_a_mask_that_is_locked_is_changed_by_nothing(what, allow, tmp_path):
    server, folder = StoppingServer((what, [0, 1, 2])), study_folder(tmp_path, allow=allow)
    with Interrupts() as interrupts, SeenDriving(folder, "P001", server, interrupts) as driving:
        briefing = driving.prepare("ee", "reach")
        driving.run(Step("practice", "ee", "reach"), 3)
        person = driving.person
    mask = person.meaning.mask(person.setting)
    owned = {name for name, own in zip(person.meaning.channels.names, mask, strict=True) if own}
    assert (owned == set(briefing.channels)) == (not allow)
    assert person.setting.switches == len(allow)


def test_every_trial_begins_in_its_mode_with_no_joint_held(tmp_path):
    """Whatever was chosen in the trial before."""
    server = StoppingServer(("mode", "direct"), ("lock", [3]))
    folder = study_folder(tmp_path, allow=["mode", "mask"])
    with Interrupts() as interrupts, SeenDriving(folder, "P001", server, interrupts) as driving:
        driving.prepare("ee", "reach")
        step = Step("practice", "ee", "reach")
        driving.run(step, 3)
        assert driving.person.setting.mode.name == "direct"
        server.unread = [(Kind.ASK, {"what": what, "value": what == "start"}) for what in ("stop", "start")]
        server.asked = 1  # another mode is chosen while the next trial is made
        server.unread.insert(0, (Kind.ASK, {"what": "mode", "value": "direct"}))
        driving.run(step, 4)
        setting = driving.person.setting
    assert (setting.mode.name, setting.locked, setting.switches) == ("ee", (), 0)
