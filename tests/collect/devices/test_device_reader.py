"""Laws of the thread that reads a device: the newest wins, no press is lost, one that is gone is found."""

import threading
import time

import pytest

from handrail.collect.devices.control_map import ControlMap, Steered
from handrail.collect.devices.device import DeviceInput
from handrail.collect.devices.device_reader import DeviceReader
from handrail.controllers.errors import HandrailError

PATIENCE = 10.0  # [s]


class Scripted:
    """A device that says what a test puts there."""

    name = "lever"

    def __init__(self):
        self.readings, self.trouble, self.opened, self.closed = [], None, 0, 0
        self.hangs = threading.Event()

    def open(self):
        if self.trouble:
            raise self.trouble
        self.opened += 1

    def read(self):
        time.sleep(0.001)
        if self.trouble:
            raise self.trouble
        return self.readings.pop(0) if self.readings else DeviceInput(0.0)

    def close(self):
        self.closed += 1


@pytest.fixture
def device():
    return Scripted()


@pytest.fixture
def poller(device):
    made = DeviceReader(device, retry=0.01)
    yield made
    made.close()


def eventually(check):
    end = time.monotonic() + PATIENCE
    while not check():
        assert time.monotonic() < end
        time.sleep(0.002)


def test_the_newest_wins_and_no_press_is_lost(device, poller):
    presses = ["", *map(str, range(5))]  # what is held at first is none
    device.readings = [DeviceInput(float(index), presses=(press,)) for index, press in enumerate(presses)]
    poller.start()
    seen = []
    eventually(lambda: seen.extend(poller.take()[1]) or len(seen) == 5)
    assert seen == list("01234")
    assert poller.take()[1] == ()


@pytest.mark.parametrize(
    "error",
    [HandrailError("lever: unplugged; plug it in"), OSError(19, "No such device"), ZeroDivisionError()],
)
def test_one_that_is_gone_is_none_until_it_is_there_again(device, poller, error):
    poller.start()
    eventually(lambda: poller.take()[0] is not None)
    device.trouble = error
    eventually(lambda: poller.take()[0] is None)
    assert "lever: " in poller.trouble
    time.sleep(0.05)
    assert poller.take()[0] is None
    device.trouble = None
    eventually(lambda: poller.take()[0] is not None)
    assert device.opened == 2
    assert device.closed >= 1
    assert poller.trouble == ""


def test_keys_pressed_before_a_device_was_gone_are_forgotten(device, poller):
    device.readings = [DeviceInput(0.0, presses=("success",))]
    poller.start()
    eventually(lambda: not device.readings)
    device.trouble = HandrailError("lever: unplugged")
    eventually(lambda: poller.trouble)
    assert poller.take() == (None, ())


def test_a_stop_before_it_was_gone_is_handed_on_once(device):
    """However long the loop did not look: an episode was being saved."""
    controls = ControlMap({"hand": {"red": ("ee.vx", 1)}}, {"red": "stop", "green": "success"})
    reader = DeviceReader(device, controls, retry=0.01)
    device.readings = [DeviceInput(0.0, presses=("green", "red", "green"))]
    reader.start()
    eventually(lambda: not device.readings)
    device.trouble = HandrailError("lever: unplugged")
    eventually(lambda: reader.trouble)
    steered = Steered(hand=True, base=False)
    assert reader.input(steered) == (None, ("stop",))
    device.trouble = None
    eventually(lambda: reader.take()[0] is not None)
    assert reader.input(steered)[1] == ()
    reader.close()


def test_what_is_held_when_it_comes_back_is_no_press_but_a_stop_is(device):
    controls = ControlMap({"hand": {"red": ("ee.vx", 1)}}, {"red": "stop", "green": "success"})
    reader = DeviceReader(device, controls, retry=0.01)
    reader.start()
    device.trouble = HandrailError("lever: unplugged")
    eventually(lambda: reader.trouble)
    device.readings, device.trouble = [DeviceInput(0.0, presses=("green", "red"))], None
    eventually(lambda: reader.input(Steered(hand=True, base=False))[1] == ("stop",))
    reader.close()


@pytest.mark.parametrize("error", [HandrailError("lever: expected one, found none"), OSError("no such port")])
def test_one_that_cannot_be_opened_at_first_is_refused_in_one_line(device, poller, error):
    device.trouble = error
    with pytest.raises(HandrailError, match=r"lever: (expected one|no such port)"):
        poller.start()
    poller.close()


def test_closed_it_gives_the_device_back(device, poller):
    poller.start()
    poller.close()
    assert device.closed == 1
