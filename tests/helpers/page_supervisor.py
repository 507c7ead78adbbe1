"""How somebody helps a policy that gets stuck: they watch the page, and hold the keys of the hand alone."""

import time

import numpy as np
from page_words import keys, way

_STUCK = 5.0  # without coming nearer, by the clock of the page [s]
_PROGRESS = 0.02  # what counts as some [m]


class PageSupervisor:
    """Watches a policy do a task, and takes the hand where it gets no nearer; never anything else.

    Args:
        driver: who looks at the page.
    """

    def __init__(self, driver):
        self.driver, self.took = driver, 0
        driver.choose("frame", "world")
        driver.set_speed(0.6)

    def supervise(self, help_on, patience=200.0):
        """Watch until the episode is over; help where the way to the aim gets no shorter, or the hand strays.

        Args:
            help_on: what one does with the hand then.
            patience: [s].
        """
        end, self._aim = time.monotonic() + patience, ""
        while not self.over and time.monotonic() < end:
            self.go_on()
            name, error = way(self.driver.text("way"))
            left = float(np.linalg.norm(error[:3]))
            if name != self._aim or left < self._nearest - _PROGRESS:
                self._aim, self._nearest, self._since = name, left, self._left
            if self._since - self._left > _STUCK:
                self.took += 1
                help_on(self, name)
                self._aim = ""
            time.sleep(0.05)

    @property
    def _left(self):
        """The time that is left on the page [s]: a busy computer's episodes last longer than they say."""
        return float(self.driver.text("clock").split()[0])

    @property
    def over(self):
        """Whether the episode is."""
        return self.driver.phase.startswith(("ready", "no connection"))

    def go_on(self):
        """Press Start where the page has paused: a busy computer was late."""
        if self.driver.phase == "paused":
            self.driver.press("Enter")
            self.driver.wait(lambda: self.driver.phase != "paused", 5.0)


def to_the_aim(supervisor, name):
    """Hold the keys of the hand for what the page says is left, until the episode is over."""
    driver = supervisor.driver
    while not supervisor.over:
        supervisor.go_on()
        driver.hold(keys(way(driver.text("way"))[1], 0.02, 0.1))
    driver.hold(set())
