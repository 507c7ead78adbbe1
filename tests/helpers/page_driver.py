"""A page of the cockpit as a person has it: the words that it shows, and keys to press."""

import re
import time
from contextlib import contextmanager

import numpy as np
from page_words import way
from playwright.sync_api import expect, sync_playwright
from scipy.spatial.transform import Rotation

CHROMIUM = ("/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome")
_FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
_NUMBERS = " ".join([r"(-?\d+\.\d+)"] * 3)
LOST = "no input: let go of everything"
expect.set_options(timeout=60_000)  # a browser that draws in software may be slow
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


class Page:
    """What is on a page, and keys that are held."""

    def __init__(self, page):
        self.page, self._held = page, set()

    def at(self, name):
        return self.page.locator(f"#{name}")

    def text(self, name):
        return self.page.evaluate("(name) => document.getElementById(name).textContent", name)

    def hold(self, keys):
        """Hold these keys, and no others."""
        for key in self._held - set(keys):
            self.page.keyboard.up(key)
        for key in set(keys) - self._held:
            self.page.keyboard.down(key)
        self._held = set(keys)


class PageDriver(Page):
    """A page, and who looks at it.

    Args:
        page: Playwright's.
        address: of the cockpit; none where the page is open already.
    """

    SCRIPT = ""  # that the page begins with

    def __init__(self, page, address=""):
        super().__init__(page)
        if address:
            page.goto(address)
        expect(self.at("numbers")).not_to_be_empty(timeout=SLOW)

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

    def end(self, save=""):
        """End the recording; save what is open by pressing a key, where there is something."""
        self.press("End")
        if save:
            expect(self.at("decision")).to_be_visible()
            self.press(save)

    def done(self, phase="ready"):
        """Say that the task is done, whatever its judge says."""
        self.press("ArrowRight")
        expect(self.at("decision")).to_contain_text("not done")
        self.press("ArrowRight")
        assert self.wait(lambda: self.phase.startswith((phase, "no connection")))

    def place(self, name="hand"):
        return self.things()[name]

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
        """Return where everything is, (3,) [m]."""
        found = re.findall(rf"^(\w+) {_NUMBERS}$", self.text("numbers"), re.MULTILINE)
        return {name: np.array(values, float) for name, *values in found}

    def hand(self):
        """Return where the hand is, and the turn from it to what the page says that it is to be like."""
        return self.place(), Rotation.from_rotvec(way(self.text("way"))[1][3:])

    def settled(self):
        """Return where the hand is once it rests, as far as one sees."""
        return self.at_rest()[0]

    def at_rest(self, patience=2.0):
        """Return the hand once it rests."""
        before, end = self.hand(), time.monotonic() + patience
        while time.monotonic() < end:
            time.sleep(0.12)
            now = self.hand()
            if np.abs(now[0] - before[0]).max() < 0.002 and (now[1] * before[1].inv()).magnitude() < 0.01:
                return now
            before = now
        return before
