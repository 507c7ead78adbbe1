"""Settings of the bench `latency`; light to import."""

import os
from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import Count
from handrail.scripts.bench.report import ReportConfig


@dataclass(frozen=True)
class LatencyConfig(ReportConfig):
    """Measure how soon the robot does what a page asks, and whether its loop keeps time, also under load."""

    seconds: Annotated[int, Meta(ge=5)] = 30
    """How long each case is driven [s]."""
    spectators: Annotated[int, Meta(ge=0, le=30)] = 4
    """Pages that watch."""
    overload: bool = True
    """Also measure with a busy program on every core, and pages that take what they are sent slowly."""
    slow_spectators: Annotated[int, Meta(ge=0, le=30)] = 20
    """How many of these."""
    browser: str = ""
    """Also measure with a browser that watches: where Chromium is, such as /usr/bin/chromium."""
    image_size: Count = 320
    """Height and width of the two cameras' pictures [pixels]; 0 for no cameras."""
    seed: Count = 0
    """Of the times at which a key is pressed."""

    def check(self) -> None:
        """Check the settings."""
        super().check()
        if self.spectators + self.slow_spectators > 30:
            raise HandrailError("--spectators and --slow_spectators: expected at most 30 together")
        if self.browser and not os.access(self.browser, os.X_OK):
            raise HandrailError(f"--browser {self.browser}: expected a program, such as /usr/bin/chromium")
