"""A synthetic participant: reads the page, steers by keys, and answers its forms; nobody's answers."""

import json
import re
import time

import numpy as np
from page_driver import LOST, SLOW, Page
from page_words import keys, way
from playwright.sync_api import expect

DECLINED = "I prefer not to answer"
DRIVING = re.compile("^(recording|practice: not recorded)$")
READY = "ready: press Start"
REMARK = "=1+1; synthetic"  # what a spreadsheet would run


class ParticipantDriver(Page):
    """Goes through a session as the page asks.

    Args:
        page: Playwright's.
        address: of the cockpit.
        seed: of the answers.
        declines: names of items that are not answered.
        answers: that they have given before, by card and item; must be on the page again.
    """

    def __init__(self, page, address, seed, declines=(), answers=()):
        super().__init__(page)
        page.goto(address)
        expect(self.at("study")).to_be_visible(timeout=SLOW)
        self._rng, self._declines = np.random.default_rng(seed), declines
        self.answers = dict(answers)
        self.trials = 0

    @property
    def title(self):
        """Of the card that covers the page, or ""."""
        card = self.at("study")
        return self.page.inner_text("#study-title") if card.is_visible() else ""

    def go_on(self, until=lambda driver: False):
        """Do what the page asks until the last card, or until something is so; return the title then."""
        while not until(self):
            title = self.title
            if title in ("Done", "Paused") and not self.at("study-next").is_visible():
                return title
            if title == "One moment" or (not title and self.text("phase") != READY):
                time.sleep(0.1)
            elif title:
                self.fill_in()
            else:
                self.drive()
        return self.title

    def fill_in(self, most=None):
        """Answer a card, or only so many of its questions; all, and wait for the next card."""
        card = self.at("study").get_attribute("data-card").partition("/")[2]  # the first part says who
        items = self.page.locator("#study .item")
        answers = self.answers.setdefault(card, {})
        for index in range(items.count())[:most]:
            box = items.nth(index)
            name = box.get_attribute("data-item")
            kept = self._kept(box)
            if name in answers:
                assert kept == answers[name], f"{card}, {name}"
            else:
                assert kept == "", f"{card}, {name}: expected nothing chosen before somebody does"
                answers[name] = self._answer(name, box)
        if most is None:
            expect(self.at("study-next")).to_be_enabled(timeout=SLOW)
            old = self.page.locator("#study-title").element_handle()
            self.page.click("#study-next")
            gone = "old => !old.isConnected || document.getElementById('study').hidden"
            self.page.wait_for_function(gone, arg=old)

    def _kept(self, box):
        """Return what is chosen or typed already; "" where nothing is."""
        for typed in box.locator("textarea, input[type=number]").all():
            if typed.input_value():
                return (
                    int(typed.input_value()) if box.locator("textarea").count() == 0 else typed.input_value()
                )
        chosen = box.locator("input[type=radio]:checked")
        return json.loads(chosen.get_attribute("data-value")) if chosen.count() else ""

    def _answer(self, name, box):
        if name in self._declines:
            box.get_by_label(DECLINED).check()
            return None
        if box.locator("textarea").count():
            box.locator("textarea").fill(REMARK)
            return REMARK
        if box.locator("input[type=number]").count():
            value = int(self._rng.integers(18, 80))
            box.locator("input[type=number]").fill(str(value))
            return value
        radios = box.locator("input[type=radio]:not(.declines *)")
        chosen = 0 if name == "consent" else int(self._rng.integers(radios.count()))
        radios.nth(chosen).check(force=True)
        return json.loads(radios.nth(chosen).get_attribute("data-value"))

    def drive(self):
        """Do the task if these keys can, or say that it failed."""
        expect(self.at("phase")).to_have_text(READY, timeout=SLOW)
        self.page.keyboard.press("Enter")
        expect(self.at("phase")).to_have_text(DRIVING, timeout=SLOW)
        self.trials += 1
        by_hand = self.page.input_value("#mode") in ("ee", "base+ee")
        if by_hand and way(self.text("way"))[0] == "goal":
            self._reach()
        else:
            self.hold({"KeyI"})
            time.sleep(0.5)
            self.hold(())
        while self._drives:
            self.page.keyboard.press("ArrowDown")
            time.sleep(0.2)

    @property
    def _drives(self):
        return bool(DRIVING.match(self.text("phase"))) and not self.title

    def _reach(self, patience=60.0):
        """Steer the hand as the page says; let go where the page was too slow to be heard, then go on."""
        end = time.monotonic() + patience
        while time.monotonic() < end and (self._drives or self.text("phase") == LOST):
            self.hold(keys(way(self.text("way"))[1], 0.02, 0.08) if self._drives else ())
            time.sleep(0.02)
        self.hold(())
