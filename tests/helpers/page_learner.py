"""Steers like somebody who sees the page for the first time: tries what each lever does, then uses it."""

import time

import numpy as np
from page_driver import LOST
from page_levers import push

_TRY = 0.4  # how long a lever is tried [s]
_TURNING = 0.3  # what a turn weighs against a way [m/rad]
_DAMPING = 0.02
_FAR = 0.7  # with more than so long to go, levers are held and watched [s]
_AHEAD = 0.25  # so early they are let go again [s]
_SHOWN = 0.25  # until what was pushed is seen on the page [s]
_SHORT = 0.03  # no push is shorter [s]
_MOST = 2.0  # that a second of a lever turns; more, and the page means another side of the thing by now [rad]


class Learner:
    """Knows what a second of each lever does to the hand, from having tried it.

    Args:
        driver: who looks at the page.
        levers: what there is to push.
        bends: whether what a lever does depends on where the arm is; then it is learned on the way.
    """

    def __init__(self, driver, levers, bends=False):
        self.driver, self.levers, self._bends = driver, levers, bends
        driver.choose("frame", "world")
        self.twists = np.zeros((6, len(levers)))

    def learn(self):
        """Try every lever twice; a computer that stumbles makes a try too small, never too large."""
        before = self.driver.at_rest()
        for index in 2 * list(range(len(self.levers))):
            before, moved, pushed = self._push(_TRY * np.eye(len(self.levers))[index], before)
            seen = moved / pushed[index]
            if _size(seen) > _size(self.twists[:, index]) and np.linalg.norm(seen[3:]) < _MOST:
                self.twists[:, index] = seen
        self._learned = self.twists.copy()

    def begin(self):
        """Think of what was learned first: the arm is again as it was then."""
        self.twists = self._learned.copy()

    def steer(self, place, near=0.02, angle=0.12, patience=25.0, until=lambda: False, rest=True):
        """Bring the hand to a place, turned as the page says; return whether it came near enough in time.

        Args:
            place: where to, (3,).
            near: good enough [m].
            angle: good enough [rad].
            patience: [s].
            until: says when it is over anyway.
            rest: whether the hand shall stand still there; else it is only passed.
        """
        end = time.monotonic() + patience
        while time.monotonic() < end and not until():
            if self.driver.phase == LOST:
                self.let_go()
                self.driver.wait(lambda: self.driver.phase != LOST, 5.0)
            error = _error(self.driver.hand(), place)
            if not rest and _is_there(error, near, angle):
                return True
            seconds = self._seconds(error)
            if not self._bends and np.abs(seconds).max() > _FAR:
                self._hold(seconds)
                continue
            self.let_go()
            before = self.driver.at_rest()
            error = _error(before, place)
            if _is_there(error, near, angle):
                return True
            seconds = self._seconds(error)
            _, moved, pushed = self._push(_shortened(seconds, _FAR), before)
            if self._bends:
                self._correct(moved, pushed)
        self.let_go()
        return False

    def let_go(self):
        self.levers.hold(np.zeros(len(self.levers)))

    def _seconds(self, error):
        """Return for how long to push each lever: `min ‖W (J s − e)‖² + λ² ‖s‖²`, (k,) [s]."""
        weights = np.array([1.0] * 3 + [_TURNING] * 3)
        moves = weights[:, None] * self.twists * self.driver.speed
        rows = np.vstack([moves, _DAMPING * np.eye(len(self.levers))])
        return np.linalg.lstsq(
            rows, np.concatenate([weights * error, np.zeros(len(self.levers))]), rcond=None
        )[0]

    def _hold(self, seconds):
        """Hold what still has a long way to go, of the group that has the longest."""
        group = max(self.levers.groups, key=lambda group: np.abs(seconds[group]).max())
        signs = np.zeros(len(seconds))
        signs[group] = np.where(np.abs(seconds[group]) > _AHEAD, np.sign(seconds[group]), 0.0)
        self.levers.hold(signs)
        time.sleep(0.03)

    def _push(self, seconds, before):
        """Push; return where the hand is then, how it moved, and how long it was pushed at full speed."""
        seconds = np.where(np.abs(seconds) < _SHORT, 0.0, seconds)
        pushed = push(self.levers, seconds) * self.driver.speed
        time.sleep(_SHOWN)
        after = self.driver.at_rest()
        moved = np.concatenate([after[0] - before[0], (after[1].inv() * before[1]).as_rotvec()])
        return after, moved, pushed

    def _correct(self, moved, pushed):
        """Believe what was seen: the smallest change of what is known that explains it (Broyden)."""
        if np.linalg.norm(pushed) > _SHORT:
            self.twists += np.outer(moved - self.twists @ pushed, pushed) / (pushed @ pushed)


def _error(hand, place):
    return np.concatenate([place - hand[0], hand[1].as_rotvec()])


def _size(twist):
    return np.hypot(np.linalg.norm(twist[:3]), _TURNING * np.linalg.norm(twist[3:]))


def _shortened(seconds, longest):
    return seconds * min(1.0, longest / max(np.abs(seconds).max(), 1e-9))


def _is_there(error, near, angle):
    return np.linalg.norm(error[:3]) < near and np.linalg.norm(error[3:]) < angle
