"""Settings of the bench `latency`; light to import."""

import os
from dataclasses import dataclass

from handrail.collect.flags import check_json, check_page, check_whole
from handrail.controllers.errors import HandrailError


@dataclass(frozen=True)
class LatencyConfig:
    """Measure how soon the robot does what a page asks, and whether its loop keeps time, also under load."""

    seconds: int = 30
    """How long each case is driven [s]."""
    spectators: int = 4
    """Pages that watch."""
    overload: bool = True
    """Also measure with a busy program on every core, and pages that take what they are sent slowly."""
    slow_spectators: int = 20
    """How many of these."""
    browser: str = ""
    """Also measure with a browser that watches: where Chromium is, such as /usr/bin/chromium."""
    image_size: int = 320
    """Height and width of the two cameras' pictures [pixels]; 0 for no cameras."""
    seed: int = 0
    """Of the times at which a key is pressed."""
    json: str = ""
    """Write everything measured to this file."""
    page: str = ""
    """Put the table into this Markdown page."""

    def check(self) -> None:
        """Check the settings."""
        check_whole(self, seconds=5, spectators=0, slow_spectators=0, image_size=0, seed=0)
        if self.spectators + self.slow_spectators > 30:
            raise HandrailError("--spectators and --slow_spectators: expected at most 30 together")
        if self.browser and not os.access(self.browser, os.X_OK):
            raise HandrailError(f"--browser {self.browser}: expected a program, such as /usr/bin/chromium")
        check_json(self.json)
        check_page(self.page)
