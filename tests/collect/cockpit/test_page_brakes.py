"""Laws of the real page, in Chromium: whatever happens to who drives, the robot brakes within 0.3 s.

Times come from the recorded episode: when an input last steered. To 0.3 s comes the longest period of the
loop in that episode, so that a busy machine does not make a law fail that holds.
"""

import json
import os
import signal
import time
from contextlib import contextmanager

import numpy as np
import pytest
from cockpit_witness import Relay, Witness, closing, is_moving, is_still
from page_driver import PageDriver
from page_recording import Recording, family

from handrail.datasets.reading.reader import read_episodes, read_frames

pytestmark = pytest.mark.slow
WITHIN = 0.3  # [s]
KEEP_SOCKETS = """
window.sockets = [];
window.WebSocket = class extends WebSocket {
  constructor(...all) { super(...all); window.sockets.push(this); }
};
"""
HIDE = """
Object.defineProperty(document, "hidden", { get: () => true, configurable: true });
document.dispatchEvent(new Event("visibilitychange"));
"""


FLAGS = ("--task", "reach", "--dataset.num_episodes", 100, "--time_limit", 600)


def steered(root, episode):
    """Return when somebody last steered in an episode [s], and the longest period of its loop [s]."""
    row = read_episodes(root)[episode]
    frames = read_frames(root, episode, ["wall_clock", "teleop.values", "teleop.mask", "action"])
    steers = np.any(frames["teleop.values"][:, :-1] * frames["teleop.mask"][:, :-1], axis=1)
    assert steers.any()
    assert not frames["action"][-1, :-1].any()
    last = np.flatnonzero(steers)[-1]
    longest = np.diff(frames["wall_clock"][: last + 2]).max()  # later ones may be pauses
    return row["started"] + frames["wall_clock"][last], float(longest)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    with closing(Recording(tmp_path_factory.mktemp("brakes"), *FLAGS)) as made:
        yield made


@pytest.fixture
def witness(recording):
    with closing(Witness(recording.address)) as made:
        made.make_ready()
        yield made


class Driven:
    """A page that drives with a key held."""

    def __init__(self, page, address, witness):
        page.add_init_script(KEEP_SOCKETS)
        self.page, self.witness = page, witness
        witness.say({"kind": "ask", "what": "give", "value": True})
        self.driver = PageDriver(page, address)
        self.take()
        self.driver.begin()
        self.press()

    def take(self):
        """Drive instead of whoever has left."""
        end = time.monotonic() + 60.0
        while not self.page.evaluate("!document.getElementById('start').disabled"):
            assert time.monotonic() < end, self.page.inner_text("body")
            button = self.page.locator("#drives button", has_text="Drive")
            if button.count():
                button.first.click()
            time.sleep(0.3)

    def press(self):
        """Hold a key until the robot moves; anew where a busy machine was too late to say so."""
        end = time.monotonic() + 60.0
        while not is_moving(self.witness.frame):
            assert time.monotonic() < end, self.witness.frame["phase"]
            self.page.keyboard.up("KeyW")
            time.sleep(0.5)
            self.page.keyboard.down("KeyW")
            time.sleep(1.0)

    def check_braked(self, recording, happened):
        """The robot came to rest, and nobody has steered since."""
        self.witness.until(is_still)
        self.page.close()
        last, longest = steered(recording.root, self.witness.end_episode())
        print(f"steered {1e3 * (last - happened):.0f} ms after it, longest period {1e3 * longest:.0f} ms")
        assert last - happened <= WITHIN + longest


@contextmanager
def driven(made, recording, witness, address=""):
    page = made.new_page(viewport={"width": 960, "height": 540})
    try:
        yield Driven(page, address or recording.address, witness)
    finally:
        page.close()


@contextmanager
def pulled(made, recording, witness):
    with closing(Relay(recording.address)) as relay, driven(made, recording, witness, relay.address) as page:
        yield page, relay


EVENTS = {
    "release": lambda page: page.keyboard.up("KeyW"),
    "blur": lambda page: page.evaluate("dispatchEvent(new Event('blur'))"),
    "tab hidden": lambda page: page.evaluate(HIDE),
    "e-stop key": lambda page: page.keyboard.press("Space"),
    "e-stop button": lambda page: page.evaluate("document.getElementById('stop').click()"),
    "garbage": lambda page: page.evaluate("sockets.at(-1).send('garbage')"),
    "binary garbage": lambda page: page.evaluate("sockets.at(-1).send(new Uint8Array([255, 254]))"),
    "socket closed": lambda page: page.evaluate("sockets.at(-1).close()"),
    "page closed": lambda page: page.goto("about:blank"),
}


@pytest.mark.parametrize("event", EVENTS)
def test_faults_of_the_page(chromium, recording, witness, event):
    with driven(chromium, recording, witness) as made:
        happened = time.time()
        EVENTS[event](made.page)
        made.check_braked(recording, time.time() if event in ("release", "e-stop key") else happened)


def test_after_a_cut_one_presses_start_and_lets_go_first(chromium, recording, witness):
    with pulled(chromium, recording, witness) as (made, relay):
        relay.break_off()
        witness.until(is_still)
        made.take()
        made.page.keyboard.press("Enter")
        witness.until(lambda frame: frame["phase"] == "driving")
        time.sleep(1.0)
        assert not any(witness.frame["ghosts"])  # nothing is asked for: the key was held all the time
        made.page.keyboard.up("KeyW")
        time.sleep(0.3)
        made.press()
        made.page.keyboard.up("KeyW")
        made.check_braked(recording, time.time())


def test_a_cable_that_is_pulled(chromium, recording, witness):
    """Nothing comes, and nobody says that nothing will; then it comes all at once, too late."""
    with pulled(chromium, recording, witness) as (made, relay):
        happened, relay.is_cut = time.time(), True
        witness.until(is_still)
        relay.is_cut = False
        time.sleep(1.0)
        assert is_still(witness.frame)
        made.page.close()
        made.check_braked(recording, happened)


@pytest.mark.parametrize("most", [0, 4000])
def test_stop_over_a_connection_that_is_stuck(chromium, recording, witness, most):
    """What was held before it arrives at once, or slowly; it is released once, and stays so."""
    with pulled(chromium, recording, witness) as (made, relay):
        relay.is_cut, relay.most = not most, most or relay.most
        witness.until(is_still)
        time.sleep(4.5)
        made.page.keyboard.press("Space")
        time.sleep(0.5)
        relay.is_cut, relay.most = False, 1e9
        witness.until(lambda frame: frame["phase"] == "stopped")
        made.page.keyboard.up("KeyW")
        time.sleep(0.3)
        made.page.keyboard.down("KeyW")
        time.sleep(1.0)
        assert is_still(witness.frame)
        made.page.keyboard.up("KeyW")
        made.driver.expect_phase("STOPPED")
        made.page.keyboard.press("Enter")
        made.driver.expect_phase("paused")
        made.page.keyboard.press("Enter")
        made.press()
        made.page.keyboard.up("KeyW")
        made.check_braked(recording, time.time())


def renderers():
    """Return the processes of pages of this test's browsers."""
    return {pid for pid, words in family(os.getpid()).items() if "--type=renderer" in words}


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_the_pages_process(chromium, recording, witness, number):
    """Killed; or stopped and continued, as a laptop that sleeps: what it says then comes too late."""
    before = renderers()
    with driven(chromium, recording, witness) as made:
        its = renderers() - before
        assert its
        happened = time.time()
        for pid in its:
            os.kill(pid, number)
        witness.until(is_still)
        for pid in its:
            if number == signal.SIGSTOP:
                os.kill(pid, signal.SIGCONT)
        time.sleep(1.0)
        assert is_still(witness.frame)
        made.check_braked(recording, happened)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_the_web_server(chromium, recording, witness, number):
    """Another one begins at the same address; the page comes back by itself, and one begins anew."""
    with driven(chromium, recording, witness) as made:
        before, happened = recording.server, time.time()
        os.kill(before, number)
        time.sleep(0.5)
        witness.until(lambda frame: frame["phase"] == "paused" and is_still(frame))
        assert recording.server != before
        made.take()
        made.page.keyboard.up("KeyW")
        made.check_braked(recording, happened)
    assert "web server ended" in recording.log.read_text()


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 130), (signal.SIGKILL, -signal.SIGKILL)])
def test_the_recording_itself(chromium, tmp_path, number, code):
    with closing(Recording(tmp_path, *FLAGS)) as recording, closing(Witness(recording.address)) as witness:
        witness.until(lambda frame: frame["phase"] == "ready")
        with driven(chromium, recording, witness) as made:
            made.page.close()
            witness.until(is_still)
            witness.end_episode()
        with driven(chromium, recording, witness):
            recording.process.send_signal(number)
            assert recording.process.wait(60) == code
        (row,) = read_episodes(recording.root)
        assert row["length"] == len(read_frames(recording.root, 0)["wall_clock"])
        info = json.loads((recording.root / "meta" / "info.json").read_text())
        assert info["total_episodes"] == 1
