"""A page of the cockpit as a person has it: the words that it shows, and keys to press."""

import re
import time
from contextlib import contextmanager

import numpy as np
from playwright.sync_api import expect, sync_playwright
from scipy.spatial.transform import Rotation

CHROMIUM = ("/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome")
_FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
_NUMBERS = " ".join([r"(-?\d+\.\d+)"] * 3)
LOST = "no input: let go of everything"
SLOW = 180_000  # patience with a page: the controller may be compiled first [ms]


@contextmanager
def browser(program):
    """Run Chromium."""
    with sync_playwright() as play:
        made = play.chromium.launch(executable_path=program, args=_FLAGS)
        try:
            yield made
        finally:
            made.close()


class PageDriver:
    """A page, and who looks at it.

    Args:
        page: Playwright's.
        address: of the cockpit; none where the page is open already.
    """

    def __init__(self, page, address=""):
        self.page = page
        if address:
            page.goto(address)
        expect(self.at("numbers")).not_to_be_empty(timeout=SLOW)

    def at(self, name):
        return self.page.locator(f"#{name}")

    def text(self, name):
        return self.page.evaluate("(name) => document.getElementById(name).textContent", name)

    def press(self, key):
        self.page.keyboard.press(key)

    @property
    def phase(self):
        return self.text("phase")

    def expect_phase(self, words, patience=60_000):
        expect(self.at("phase")).to_have_text(words, timeout=patience)

    def begin(self, phase="recording"):
        self.expect_phase("ready: press Start", SLOW)
        self.press("Enter")
        self.expect_phase(phase)

    def choose(self, what, value):
        self.at(what).select_option(value)
        expect(self.at(what)).to_have_value(value)

    def push(self, key, seconds):
        """Hold a key."""
        self.page.keyboard.down(key)
        time.sleep(seconds)
        self.page.keyboard.up(key)

    def place(self, name="hand"):
        return self.things()[name][0]

    @property
    def speed(self):
        """Share of full speed that is chosen."""
        return float(self.text("speed-said").split()[0]) / 100.0

    def set_speed(self, share):
        """Press the keys for slower and faster until the page says a speed."""
        for _ in range(12):
            before = self.speed
            if abs(before - share) < 0.05 or self.phase.startswith(("ready", "no connection")):
                return  # it is so, or the episode is over
            self.press("Minus" if before > share else "Equal")
            self.wait(lambda before=before: self.speed != before, 5.0)
        raise AssertionError(f"speed stays at {self.speed}")

    def wait(self, come, patience=60.0):
        """Wait until something has come; return whether it has."""
        end = time.monotonic() + patience
        while not (found := come()) and time.monotonic() < end:
            time.sleep(0.05)
        return found

    @property
    def opening(self):
        """Of the gripper, 0 to 1."""
        (percent,) = re.findall(r"gripper (\d+) % open", self.text("numbers"))
        return int(percent) / 100.0

    def things(self):
        """Return where everything is, (3,), and how far the hand would have to turn to be like it."""
        found = re.findall(rf"\b(\w+) {_NUMBERS}(?: turn {_NUMBERS})?", self.text("numbers"))
        numbers = {name: [float(each or 0.0) for each in values] for name, *values in found}
        return {name: (np.array(x[:3]), Rotation.from_rotvec(x[3:])) for name, x in numbers.items()}

    def hand(self, mark):
        """Return where the hand is, and how it is turned against something that stands still."""
        things = self.things()
        return things["hand"][0], things[mark][1].inv()

    def settled(self, mark, patience=2.0):
        """Return the same once the hand rests, as far as one sees."""
        before, end = self.hand(mark), time.monotonic() + patience
        while time.monotonic() < end:
            time.sleep(0.12)
            now = self.hand(mark)
            still = np.abs(now[0] - before[0]).max() < 0.002 and (now[1] * before[1].inv()).magnitude() < 0.01
            if still:
                return now
            before = now
        return before
