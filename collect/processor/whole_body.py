"""A robot of LeRobot's as a whole body: what it says becomes a state, velocities become its action."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from handrail.collect.processor.units import BodyReading, RobotUnits
from handrail.collect.world.plant import Gate
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError, shown
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import DEAD_MAN_TIME
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import RobotModel

_LEAD = 0.2  # how far a joint's target may be ahead of where the joint is [rad, m]
_LONGEST = 0.1  # for which a target goes on at once, where commands come late [s]
_HOLD = 0.5  # for how long a base may go on as it was sent: LeKiwi's watchdog [s]
_SILENT = 2.5  # periods without an observation, after which velocities say nothing of the way,
_OFTEN = 0.1  # but this long at least: a robot may speak less often than it is asked [s]
_BEYOND = 0.5  # of a joint's range, where it may be found [rad, m]
_PUSHED = 4.0  # a base goes no faster, as a share of its limit: people push robots
_STROKES = 1.5  # of a gripper whose speed nobody knows [1/s]


def moved(pose: FloatArray, twist: FloatArray, seconds: float) -> FloatArray:
    """Return the base's pose after a constant twist, (3,): `p + h R(θ + ½ h ω) v`, `θ + h ω`.

    The midpoint rule, with an error of `h³ ω² v / 24`: 1 µm a step at 30 Hz, 1.5 rad/s and 0.3 m/s.

    Args:
        pose: x, y, heading in the world [m, rad], (3,).
        twist: in the base's frame [m/s, rad/s], (3,).
        seconds: h [s].
    """
    return pose + seconds * turned(twist, pose[2] + 0.5 * seconds * twist[2])


def _wrapped(pose: ArrayLike) -> FloatArray:
    """Return a pose or a way of the base whose heading is within ±π, (3,)."""
    x, y, heading = np.asarray(pose, dtype=np.float64)
    return np.array([x, y, math.remainder(heading, 2.0 * math.pi)])


class WholeBody:
    """Knows where a robot is, and what it was sent.

    A joint that takes positions is sent the path of its velocity, `r⁺ = r + ½ h (v + v⁺)`: on from the target
    before, not from where it is, so that a joint that sags under its weight sags no further. h is the time
    since the command before, so that the arm keeps pace with a base in a slow loop. The target goes no
    farther ahead of the joint than 0.2 rad; where it would, the whole arm slows down and stays on its path.
    Whatever is measured, a target moves no faster than its joint may: `|r⁺ − r| ≤ h v_max`.

    A robot without odometry is where its base's velocities have led; where it was not heard for more than
    2.5 periods (0.1 s at least), where what it was sent has led. A heading is taken as the same one within
    ±π. An observation that makes no sense, or the very same object again, is none: the base goes on as it was
    sent, until the next one. So is one in which a joint is where it cannot have come, `|q⁺ − q| > v_max Δt +
    0.2`, or at first 0.5 beyond its range, or the base faster than four times its limit.

    Args:
        model: of the robot.
        units: its names and units.
        period: from one command to the next [s].
        timeout: age from which an observation is stale [s].

    Attributes:
        trouble: what is wrong with the observation now; empty if nothing is.
        targets: where the arm's joints are sent, (n − b,) [rad, m]; one that takes a velocity, where it is.
        sent: the command sent last, inside the limits, (n + h,).
    """

    def __init__(
        self, model: RobotModel, units: RobotUnits, period: float, timeout: float = DEAD_MAN_TIME
    ) -> None:
        self._model, self._units, self._period, self._timeout = model, units, period, timeout
        self._silent = max(_SILENT * period, _OFTEN)
        self._b = len(model.description.base.joints)
        limits = model.description.limits
        self._fastest_base = limits.velocity[:3] if self._b else np.zeros(3)
        self._fastest = limits.velocity[self._b :]
        self._ends = limits.position_lower[self._b :], limits.position_upper[self._b :]
        grippers = [hand.gripper for hand in model.description.hands]
        strokes = [each.speed / each.stroke if each else _STROKES for each in grippers]
        self._grip_steps = period * np.array(strokes)
        self.reset()

    def reset(self, base: ArrayLike = (0.0, 0.0, 0.0), rests: bool = True) -> None:
        """Begin anew with the next observation.

        Args:
            base: where the base is taken to be then, (3,) [m, rad].
            rests: whether the base is taken to rest then; else its measured velocity counts as sent.
        """
        self._rests = rests
        self._gate = Gate(self._model, self._period, precision=np.float64)
        self._base = _wrapped(base)
        self._reading: BodyReading | None = None
        self._said: object = None
        self._heard, self._time, self._sent_at = -math.inf, -math.inf, -math.inf
        self._held = np.zeros(self._model.size, dtype=bool)
        self._twist, self.trouble, self._grips = np.zeros(3), "", np.zeros(len(self._grip_steps))
        self._under_way, self._rested = np.zeros(3), 0.0
        self.sent = np.zeros(self._model.size + len(self._grips))
        self.targets = np.zeros(self._model.size - self._b)

    def place(self, base: ArrayLike) -> None:
        """Take the base to be somewhere now, (3,) [m, rad]; the robot has no odometry of its own."""
        self._base, self._heard = _wrapped(base), self._time

    @property
    def velocity(self) -> FloatArray:
        """The command sent last, (n,)."""
        return self._gate.velocity

    @property
    def openings(self) -> FloatArray:
        """How far each hand's gripper is open, from 0 to 1, (h,)."""
        return self._reading.openings if self._reading else np.zeros(len(self._grips))

    def observe(self, observation: Any, now: float) -> State:
        """Take what the robot says, and return its state.

        Args:
            observation: LeRobot's.
            now: on any clock that advances [s].
        """
        reading = self._units.read(observation)
        if now < self._time:  # the clock was put back; what was heard is as old as before
            self._heard -= self._time - now
        if reading and self._leaps(reading, now):
            reading = None
        self.pass_time(now)
        if reading and observation is not self._said:
            self._take(reading, now)
        self._said = observation
        if self._reading is None:
            raise HandrailError(
                f"observation of {self._model.description.name}: expected finite numbers "
                f"{', '.join(self._units.observation_names)}, joints within their ranges in their units; "
                f"got {shown(observation)}"
            )
        stale = "stale_observation" if now - self._heard > self._timeout else ""
        self.trouble = stale if reading else "malformed_observation"
        v = np.where(self._held, 0.0, self.velocity)
        self.targets = np.where(self._units.sends_position, self.targets, self._reading.arm)
        expected = np.append(self._expected()[: self._b], self.targets)
        return State(np.append(self._now(), self._reading.arm), v, now, self.velocity, expected)

    def pass_time(self, now: float) -> None:
        """Take note of how far the base was sent until now [s], said later: `sent - said`, 0 after a rest."""
        passed = _passed(self._time, now, _HOLD)
        if math.inf > now - self._sent_at > _HOLD:  # a watchdog stops the base, if no reading differs
            self._gate.velocity[: self._b] = 0.0
        silent = now - self._heard > self._silent
        self._rested = 0.0 if self._twist.any() or silent else self._rested + passed
        going = moved(self._expected(), self._twist, passed) - self._base
        most = 2.0 * _HOLD * self._fastest_base
        self._under_way = np.zeros(3) if self._rested > _HOLD else np.clip(going, -most, most)
        self._time = now if math.isfinite(now) else self._time

    def send(self, command: ArrayLike) -> dict[str, float]:
        """Return the robot's action for a command, inside the limits.

        Args:
            command: velocities at the end of a period, the base's in the world, and grippers, (n + h,).
        """
        assert self._reading is not None
        b, base = self._b, self._expected()
        passed, self._sent_at = self._time - self._sent_at, self._time
        if passed > self._timeout:  # meanwhile joints stand at their targets
            self._gate.velocity[b:][self._units.sends_position] = 0.0
        before = self._gate.velocity
        self.sent = self._gate.limit(command, np.append(base[:b], self.targets))
        since = min(passed, _LONGEST) if 0.0 < passed <= self._timeout else self._period
        way = 0.5 * since * (before + self._gate.velocity)[b:]
        arm = self._reading.arm
        most = np.where(way > 0.0, arm + _LEAD - self.targets, self.targets - arm + _LEAD)
        share = np.min(most / np.maximum(np.abs(way), 1e-12), initial=1.0)  # all slow down: the path stays
        step = np.clip(self.targets + max(share, 0.0) * way, arm - _LEAD, arm + _LEAD) - self.targets
        farthest = self._fastest * max(self._period, passed)  # which may be NaN
        lower = np.minimum.reduce([self._ends[0], self.targets, arm])
        upper = np.maximum.reduce([self._ends[1], self.targets, arm])
        self.targets = np.clip(self.targets + np.clip(step, -farthest, farthest), lower, upper)
        self._held[b:] = share < 1.0
        self._twist = turned(self._gate.velocity[:3], -base[2]) if b else np.zeros(3)
        self._grips += np.clip(self._gate.grippers - self._grips, -self._grip_steps, self._grip_steps)
        return self._units.action(self.targets, self._gate.velocity[b:], self._twist, self._grips)

    def _leaps(self, reading: BodyReading, now: float) -> bool:
        """Return whether a joint is where it cannot have come, or the base is too fast."""
        if self._b and bool((np.abs(reading.twist) > _PUSHED * self._fastest_base).any()):
            return True
        if self._reading is None:
            lower, upper = self._ends
            return bool(((reading.arm < lower - _BEYOND) | (reading.arm > upper + _BEYOND)).any())
        way = self._fastest * max(now - self._heard, 0.0)
        return bool((np.abs(reading.arm - self._reading.arm) > way + _LEAD).any())

    def _take(self, reading: BodyReading, now: float) -> None:
        """Take an observation that makes sense."""
        before, base = self._reading, self._base
        silent = before is not None and now - self._heard > self._silent
        if before is None:
            self.targets = reading.arm.copy()
            self._grips = 1.0 - reading.openings
            self._gate.grippers = tuple(self._grips.tolist())
        elif reading.pose is None and silent:  # two velocities say nothing of the way between
            self._base, base, self._under_way = self._expected(), self._expected(), np.zeros(3)
        elif reading.pose is None:
            passed = _passed(self._heard, now, self._timeout)
            self._base = moved(self._base, 0.5 * (before.twist + reading.twist), passed)
        self._base = _wrapped(self._base if reading.pose is None else reading.pose)
        if math.inf > now - self._sent_at > _HOLD or (before is None and not self._rests):
            twist = turned(reading.twist, self._base[2])
            within = np.clip(twist, -self._fastest_base, self._fastest_base)
            self._gate.velocity[: self._b] = within[: self._b]
        if before is not None:
            change = _wrapped(self._base - base)  # a heading begins anew at ±π
            farthest = self._fastest_base * _passed(self._heard, now, math.inf) + _LEAD
            self._under_way -= np.where(np.abs(change) <= farthest, change, 0.0)  # else it was corrected
        self._reading = reading
        self._heard = now if math.isfinite(now) else self._heard

    def _expected(self) -> FloatArray:
        """Return where the base will be when it has done what it was sent so far, (3,)."""
        return self._base + self._under_way

    def _now(self) -> FloatArray:
        """Return where the base is, (b,): since it was last heard of it goes on as it was sent."""
        return moved(self._base, self._twist, _passed(self._heard, self._time, self._timeout))[: self._b]


def _passed(since: float, now: float, most: float) -> float:
    """Return how long ago something was, no longer than a time; 0 of a clock that says no number [s]."""
    passed = now - since
    return min(max(passed, 0.0), most) if math.isfinite(passed) else 0.0
