"""How somebody helps a policy that gets stuck: they watch the page, and hold the keys of the hand alone."""

import time

import numpy as np
from page_words import keys, way

_STUCK = 5.0  # without coming nearer [s]
_PROGRESS = 0.02  # what counts as some [m]
_OVER, _TIPS = 0.12, 0.005  # the cube: from where one comes down, and where it is taken [m]
_UP = np.array([0.0, 0.0, 1.0])


class PageSupervisor:
    """Watches a policy do a task, and takes the hand where it gets no nearer; never anything else.

    Args:
        driver: who looks at the page.
    """

    def __init__(self, driver):
        self.driver, self.took = driver, 0
        driver.choose("frame", "world")
        driver.set_speed(0.6)

    def supervise(self, help_on, strays=lambda driver, name: False, patience=200.0):
        """Watch until the episode is over; help where the way to the aim gets no shorter, or the hand strays.

        Args:
            help_on: what one does with the hand then.
            strays: says whether it does, on the way to an aim.
            patience: [s].
        """
        end, self._aim = time.monotonic() + patience, ""
        while not self.over and time.monotonic() < end:
            self._go_on()
            name, error = way(self.driver.text("way"))
            left = float(np.linalg.norm(error[:3]))
            if name != self._aim or left < self._nearest - _PROGRESS:
                self._aim, self._nearest, self._since = name, left, time.monotonic()
            if time.monotonic() - self._since > _STUCK or strays(self.driver, name):
                self.took += 1
                help_on(self, name)
                self.driver.hold(set())
                self._aim = ""
            time.sleep(0.05)
        self.driver.hold(set())

    @property
    def over(self):
        """Whether the episode is."""
        return self.driver.phase.startswith(("ready", "no connection"))

    def steer(self, place, near=0.015, patience=20.0):
        """Hold the keys of the hand until it is at a place, turned as the page says; return whether it is.

        Args:
            place: says where that is now.
            near: good enough on each axis [m].
            patience: [s].
        """
        end = time.monotonic() + patience
        while not self.over and time.monotonic() < end:
            self._go_on()
            turn = way(self.driver.text("way"))[1][3:]
            error = np.concatenate([place() - self.driver.place(), turn])
            wanted = keys(error, near, 0.12)
            if not wanted:
                return True
            self.driver.hold(wanted)
            small = np.abs(error[:3]).max() < 0.06 and np.abs(turn).max() < 0.3
            time.sleep(0.06)
            if small:  # a short push, then look
                self.driver.hold(set())
                time.sleep(0.15)
        return False

    def _go_on(self):
        """Press Start where the page has paused: a busy computer was late."""
        if self.driver.phase == "paused":
            self.driver.hold(set())
            self.driver.press("Enter")
            self.driver.wait(lambda: self.driver.phase != "paused", 5.0)


def to_the_aim(supervisor, name):
    """Bring the hand to the goal."""
    supervisor.steer(lambda: supervisor.driver.place(name), 0.01)


def misses(driver, name):
    """Whether the hand comes down beside the cube, or comes to the bin beside its middle."""
    things = driver.things()
    if name not in things:
        return False
    x, y, up = things["hand"] - things[name]
    beside = np.hypot(x, y)
    return up < 0.10 and 0.012 < beside < 0.3 if name == "cube" else up < 0.4 and 0.06 < beside < 0.35


def pick_and_place(supervisor, name):
    """Bring the hand over the cube and down to it, or over the bin; the gripper is the policy's."""
    to = supervisor.driver.place
    if name == "cube":
        if np.hypot(*(to("cube") - to())[:2]) > 0.03:
            supervisor.steer(lambda: np.append(to()[:2], to("cube")[2] + _OVER), 0.03)
            supervisor.steer(lambda: to("cube") + _OVER * _UP, 0.015)
        supervisor.steer(lambda: to("cube") + _TIPS * _UP, 0.008)
    else:
        supervisor.steer(lambda: np.append(to()[:2], to("bin")[2] + 0.25), 0.06)
        supervisor.steer(lambda: to("bin") + 0.2 * _UP, 0.03)
