"""A person at the page who carries a box with both hands, and knows where it is and how it is turned."""

import time

import numpy as np
from page_driver import PageDriver
from page_learner import Learner
from page_levers import Keys, Pad, push
from page_tasks import over
from page_words import way_of
from scipy.spatial.transform import Rotation

from handrail.collect.operators.scripted.steering import Gains
from handrail.collect.world.tasks.carry_box import GRASP

_WATCH = """
window.said = {};
window.WebSocket = class extends WebSocket {
  constructor(...words) {
    super(...words);
    this.addEventListener("message", ({data}) => {
      const said = typeof data === "string" ? JSON.parse(data) : {};
      if (["stage", "frame"].includes(said.kind)) window.said[said.kind] = said[said.kind];
    });
  }
};
"""
_SEEN = """() => {
  const {stage, frame} = window.said, at = 7 * stage.shapes.bodies.indexOf("box");
  return [...frame.tools, frame.poses.slice(at, at + 7)];
}"""
_DOWN = Rotation.from_matrix([[1, 0, 0], [0, -1, 0], [0, 0, -1]])  # a hand that points down, x forward
FULL = Gains().full[:6]  # stick of the hand [m/s, rad/s]
_UP = np.array([0.0, 0.0, 1.0])
_OVER, _INSIDE = 0.16, 0.19  # above where hands hold it while they carry it; behind the table's edge [m]


class PairDriver(PageDriver):
    """A page whose keys mean both hands: the hand of all others is half-way between them."""

    SCRIPT = _WATCH
    wanted = _DOWN  # how both hands shall be turned

    def hand(self):
        left, right, _ = self.poses()
        return (left[0] + right[0]) / 2, self.wanted * left[1].inv()

    def place(self, name="hand"):
        return self.hand()[0] if name == "hand" else super().place(name)

    def poses(self):
        """Return where the hands and the box are and how they are turned."""
        seen = self.page.evaluate(_SEEN)
        return [(np.array(each[:3]), Rotation.from_quat([*each[4:], each[3]])) for each in seen]

    @property
    def are_open(self):
        return min(self.page.evaluate("() => window.said.frame.openings")) > 0.5


class PairKeys(Keys):
    """The same keys; each gripper has one of its own."""

    def twists(self):
        """Return what a second of each lever does, (6, k): what its key is for, at full stick."""
        return np.array([FULL * way_of(first) for first, _ in self.pairs]).T

    def grip(self):
        for key in ("ShiftLeft", "ShiftRight"):
            self._driver.press(key)


class PairPad(Pad):
    """The same sticks; the triggers are the grippers'."""

    def twists(self):
        """Return the same of the sticks."""
        axes, signs = [1, 0, 5, 2, 3, 4], [-1, -1, -1, -1, 1, -1]
        return (FULL * np.eye(6))[:, axes] * signs

    def grip(self):
        for button in (6, 7):
            self.tap(button)


class PairLearner(Learner):
    """Knows already what keys and sticks do."""

    def learn(self):
        self.twists = self._learned = self.levers.twists()
        push(self.levers, 0.3 * np.eye(len(self.levers))[0])  # so that the page knows the device


def carry_box(learner):
    """Carry the box to the other table; try again where it stayed behind."""
    driver = learner.driver
    done = lambda: over(driver)  # noqa: E731
    while not done():
        if not driver.are_open:
            learner.levers.grip()
        at, turned = driver.poses()[2]
        pick = at + turned.apply(GRASP)
        driver.wanted = turned * _DOWN
        _slowly(learner, pick + 0.12 * _UP, pick, done)
        learner.levers.grip()
        time.sleep(1.2)
        learner.steer(pick + _OVER * _UP, 0.04, 0.2, until=done)
        if driver.poses()[2][0][2] > at[2] + 0.05:
            _put_down(learner, pick, done)


def _put_down(learner, pick, done):
    driver, things = learner.driver, learner.driver.things()
    driver.wanted = _DOWN
    driver.set_speed(1.0)
    back = min([0.0, *(at[0] for name, at in things.items() if name.startswith("obstacle"))]) + 0.1
    for y in (pick[1], things["table"][1]):
        learner.steer(np.array([back, y, pick[2] + _OVER]), 0.15, 0.3, until=done, rest=False)
    table, height = things["table"], 2.0 * (things["table"] - things["box_table"])[2]
    place = np.array([table[0] - 0.3 + _INSIDE, table[1], pick[2] + height])
    _slowly(learner, place + 0.1 * _UP, place + 0.008 * _UP, done)
    learner.levers.grip()
    time.sleep(1.0)
    learner.steer(place + 0.2 * _UP, 0.03, 0.3, until=done)
    driver.wait(done, 3.0)


def _slowly(learner, above, place, done):
    """Go above a place, and down to it more slowly."""
    learner.driver.set_speed(1.0)
    learner.steer(above, 0.03, 0.1, until=done)
    learner.driver.set_speed(0.4)
    learner.steer(place, 0.012, 0.1, until=done)
