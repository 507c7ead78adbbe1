"""How somebody helps a policy that gets stuck: they watch the page, and hold the keys of the hand alone."""

import time

import numpy as np
from page_words import keys, way

_STUCK = 5.0  # without coming nearer, by the clock of the page [s]
_PROGRESS = 0.02  # what counts as some [m]
_OVER, _TIPS = 0.12, 0.005  # the cube: from where one comes down, and where it is taken [m]
# Holds keys until the hand is at a thing, by what the page says: far away all the time, near by short pushes.
# In the page, so that a busy computer lets go of no key too late. An offset of null leaves its axis as it is.
_STEER = """
async ([thing, offset, near, patience]) => {
  const text = (id) => document.getElementById(id).textContent;
  const line = (name) => text("numbers").split("\\n").find((each) => each.startsWith(`${name} `));
  const where = (name) => line(name).split(" ").slice(1).map(Number);
  const held = new Set(), pairs = ["SW", "DA", "FR"], full = 0.35 * parseFloat(text("speed-said")) / 100;
  const event = (code) => ({ code, key: code, bubbles: true });
  const say = (kind, code) => document.body.dispatchEvent(new KeyboardEvent(kind, event(code)));
  const hold = (codes) => {
    for (const code of held) if (!codes.includes(code)) { say("keyup", code); held.delete(code); }
    for (const code of codes) if (!held.has(code)) { say("keydown", code); held.add(code); }
  };
  const rest = (ms) => new Promise((done) => setTimeout(done, ms));
  const end = performance.now() + 1000 * patience;
  let isThere = false;
  while (!isThere && performance.now() < end && document.body.dataset.phase === "driving") {
    const hand = where("hand"), there = where(thing);
    const error = hand.map((x, axis) => (offset[axis] === null ? 0 : there[axis] + offset[axis] - x));
    const most = Math.max(...error.map(Math.abs));
    isThere = most <= near;
    const codes = error.map((x, axis) => Math.abs(x) > near && `Key${pairs[axis][Number(x > 0)]}`);
    hold(codes.filter(Boolean));
    await rest(most > 0.08 ? 30 : Math.min(250, 1000 * most / full));
    if (most <= 0.08) { hold([]); await rest(150); }
  }
  hold([]);
  return isThere;
}
"""


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
            self.go_on()
            name, error = way(self.driver.text("way"))
            left = float(np.linalg.norm(error[:3]))
            if name != self._aim or left < self._nearest - _PROGRESS:
                self._aim, self._nearest, self._since = name, left, self._left
            if self._since - self._left > _STUCK or strays(self.driver, name):
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

    def steer(self, thing, offset, near=0.015, patience=20.0):
        """Hold the keys of the hand until it is beside a thing; return whether it is.

        Args:
            thing: its name on the page.
            offset: from it to where the hand shall be, None where it may be as it is, (3,).
            near: good enough on each axis [m].
            patience: [s].
        """
        end = time.monotonic() + patience
        while not self.over and time.monotonic() < end:
            self.go_on()
            if self.driver.page.evaluate(_STEER, [thing, list(offset), near, patience]):
                return True
        return False

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


def misses(driver, name):
    """Whether the hand comes down beside the cube, or comes with it to the bin, beside its middle."""
    things = driver.things()
    if name not in ("cube", "bin"):
        return False
    x, y, up = things["hand"] - things[name]
    beside = np.hypot(x, y)
    return up < 0.10 and 0.012 < beside < 0.3 if name == "cube" else _holds(things) and 0.06 < beside < 0.35


def pick_and_place(supervisor, name):
    """Bring the hand over the cube and down to it, or over the bin; the gripper is the policy's."""
    things = supervisor.driver.things()
    if name == "cube":
        if np.hypot(*(things["cube"] - things["hand"])[:2]) > 0.02:
            supervisor.steer(name, (None, None, _OVER), 0.03)
        supervisor.steer(name, (0.0, 0.0, _OVER), 0.012)
        supervisor.steer(name, (0.0, 0.0, _TIPS), 0.008)
    elif name == "bin" and np.hypot(*(things["bin"] - things["hand"])[:2]) < 0.5:
        supervisor.steer(name, (None, None, 0.25 if _holds(things) else 0.4), 0.06)
        if _holds(things):
            supervisor.steer(name, (0.0, 0.0, 0.2), 0.03)


def _holds(things):
    return np.linalg.norm(things["cube"] - things["hand"]) < 0.08
