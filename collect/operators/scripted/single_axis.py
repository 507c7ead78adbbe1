"""One axis at a time: the operator picks a joint, drives it where it seems to belong, picks the next."""

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.input_map import InputMap
from handrail.collect.operators.scripted.placement import REACHED, arm_solutions
from handrail.collect.operators.scripted.steering import MotionGoal, Target
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.controller import State
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import Pose, RobotModel

_NEAR = 0.35  # share of the tolerance that one axis may use up
_MOST_CARE = 0.1
_PREPARATION = 1.35  # of the mind before it thinks again: M of the keystroke-level model [s]
_SHARES = (1.0, 0.5, 0.25)  # of an axis' way that the operator considers
_SMALL_SHARES = (1.0, 0.5, 0.25, 0.12, 0.06)  # the same where the hand must not lean
_CLEAR = 0.03  # what a sweep shall keep clear [m]


_SWEEP = np.linspace(0.25, 1.0, 4)  # where on a joint's way one looks whether something is hit


def plan_joints(
    model: RobotModel, collision: CollisionModel, q: FloatArray, goal: Pose, clear: float
) -> tuple[FloatArray, list[int]]:
    """Return where the joints belong, (n,), and an order in which they can go there, hitting nothing.

    The solution of the inverse kinematics nearest to q if there is an order for it; else the first that has
    one, starting from q with one joint turned by 1.5 rad either way; the most complete if none has.

    Args:
        model: of the robot.
        collision: distances in the scene.
        q: to begin with, (n,).
        goal: of the tool.
        clear: distance kept on the way, less where the robot is nearer at either end [m].
    """
    best, most = (q, list[int]()), -1.0
    arm = list(range(len(model.description.base.joints), model.size))
    at_start = _nearest(collision, q)
    for there, error in arm_solutions(model, q, goal):
        kept = min(clear, 0.9 * at_start, 0.9 * _nearest(collision, there))
        preferred = sorted(arm, key=lambda index: -abs(there[index] - q[index]))
        order = clear_order(collision, q, there, preferred, kept) if kept > 0.0 else []
        share = len(order) / len(arm) - (error > REACHED)
        if share > most:
            best, most = (there, order), share
        if share == 1.0:
            break
    return best


def _nearest(collision: CollisionModel, q: FloatArray) -> float:
    return float(np.min(collision.values(q[None, :])))


def clear_order(
    collision: CollisionModel, q: FloatArray, goal: FloatArray, joints: list[int], clear: float
) -> list[int]:
    """Return an order of the joints in which each can go all its way, those given first preferred.

    Depth-first over the sets of joints that have been moved; the longest such order if none has them all.

    Args:
        collision: distances in the scene.
        q: to begin with, (n,).
        goal: to end with, (n,); only the joints given move.
        joints: their indices, in the order preferred.
        clear: distance kept on the way [m].
    """
    seen: set[frozenset[int]] = set()
    longest: list[int] = []

    def search(moved: list[int]) -> bool:
        nonlocal longest
        longest = max(longest, moved, key=len)
        if len(moved) == len(joints):
            return True
        seen.add(frozenset(moved))
        now = q.copy()
        now[moved] = goal[moved]
        for joint in joints:
            following = frozenset((*moved, joint))
            if joint in moved or following in seen:
                continue
            free = sweep_clearance(collision, now, joint, goal[joint] - now[joint]) >= clear
            if free and search([*moved, joint]):
                return True
        return False

    search([])
    return longest


def sweep_clearance(collision: CollisionModel, q: FloatArray, joint: int, way: float) -> float:
    """Return the smallest distance to anything while one joint moves [m].

    Args:
        collision: distances in the scene.
        q: to begin with, (n,).
        joint: its index.
        way: how far it goes [m, rad].
    """
    path = np.tile(q, (len(_SWEEP), 1))
    path[:, joint] += _SWEEP * way
    return float(np.min(collision.values(path)))


class SingleAxisMap(InputMap):
    """A single stick on the base's axes and the arm's joints, one at a time; changing is a mode switch.

    The operator knows which joints would put the hand where it seems to belong. They move one joint after the
    other, in an order in which nothing is hit, and think anew when all are near. The base likewise, axis by
    axis.
    """

    def reset(self, view: View, settings: HumanSettings, rng: np.random.Generator) -> None:
        """Begin with no axis chosen and nothing thought."""
        self._least = 1.2 * settings.threshold
        self._collision = CollisionModel(self._model, view.task.obstacles)
        self._axis: int | None = None
        self._axis_holds = False  # until the operator thinks again
        self._left = 0.0  # of the way that the axis shall not go this time
        self._goal = np.zeros(self._model.size)
        self._thought = b""
        self._thinks_at = -np.inf
        self._order: list[int] = []
        self._care = 1.0  # share of the usual tolerance: less after each attempt that was not good enough

    def wanted(self, goal: MotionGoal, state: State) -> tuple[BoolArray, FloatArray]:
        """Return the mask of the axis chosen, and how far the stick shall be pushed."""
        values = np.zeros(self.channels.size)
        if goal.target is not None:
            self._think(goal.target, state)
            errors, tolerances = self._errors(goal, goal.target, state.q)
            axis = self._choose(goal.target, errors, tolerances, state.q)
            if axis is not None:
                speed = self._fastest(goal.target, state.q)[axis]
                values[axis] = self._push(errors[axis] - self._left, speed, self._least * self.full[axis])
        return np.arange(self.channels.size) == (self._axis or 0), values

    def _push(self, way: float, fastest: float, slowest: float) -> float:
        """Return the speed at which an axis is driven on its way; nobody pushes a stick below `slowest`."""
        return float(np.sign(way) * np.clip(self._gains.gain * abs(way), min(slowest, fastest), fastest))

    def _choose(
        self, target: Target, errors: FloatArray, tolerances: FloatArray, q: FloatArray
    ) -> int | None:
        """Return the axis to push: the same until it is where it shall be, then another; None rests."""
        axis = self._axis
        if self._axis_holds and axis is not None and abs(errors[axis] - self._left) > tolerances[axis]:
            return axis
        off = np.abs(errors) / tolerances
        rank = {index: place for place, index in enumerate(self._order)}
        farthest = sorted(np.flatnonzero(off > 1.0).tolist(), key=lambda index: -off[index])
        candidates = sorted(farthest, key=lambda index: rank.get(index, len(rank)))
        best, widest = None, -np.inf
        for index, share in self._options(target, candidates, errors, off, q):
            clear = self._clearance(index, share * errors[index], q)
            if clear > widest:
                best, widest = (index, share), clear
            if clear >= _CLEAR:
                break
        return self._take(*best, errors) if best else None

    def _options(
        self, target: Target, candidates: list[int], errors: FloatArray, off: FloatArray, q: FloatArray
    ) -> list[tuple[int, float]]:
        """Return the axes and shares of their ways that matter, the best first.

        All of the way before a part of it; where the hand must not lean, only what keeps it upright enough,
        or straightens it most if nothing does.
        """
        shares = _SHARES if np.isinf(target.tilt) else _SMALL_SHARES
        options = [(index, share) for share in shares for index in candidates if share * off[index] > 1.0]
        if np.isinf(target.tilt):
            return options
        lean = {
            (index, share): self._lean(target, index, share * errors[index], q) for index, share in options
        }
        upright = [option for option in options if lean[option] <= target.tilt]
        return upright or sorted(options, key=lambda option: lean[option])

    def _take(self, index: int, share: float, errors: FloatArray) -> int:
        """Take an axis and go a share of its way."""
        self._axis_holds = True
        self._axis, self._left = index, (1.0 - share) * errors[index]
        return index

    def _clearance(self, index: int, way: float, q: FloatArray) -> float:
        """Return how much an arm joint's motion keeps clear of everything, no more than is asked for [m]."""
        if index < self._arm.start:
            return _CLEAR  # the script says where to drive
        joint = index - self.channels.joint_slice.start
        return min(sweep_clearance(self._collision, q, joint, way), _CLEAR)

    def _lean(self, target: Target, index: int, way: float, q: FloatArray) -> float:
        """Return how far the hand leans from the target's axis after an axis' motion [rad]."""
        there = q.copy()
        there[index - self.channels.joint_slice.start if index >= self._arm.start else index] += way
        upright = self._model.pose(there).rotation[:, 2] @ target.hand.rotation[:, 2]
        return float(np.arccos(np.clip(upright, -1.0, 1.0)))

    def _think(self, target: Target, state: State) -> None:
        """Work out which joints would do it, for a new target, or when they did not."""
        done = np.all(self._goal_error(target, state.q) < 1.0) and state.time >= self._thinks_at
        if target.identity == self._thought and not done:
            return
        self._goal, order = plan_joints(self._model, self._collision, state.q, target.hand, _CLEAR)
        self._order = [self.channels.joint_slice.start + joint for joint in order]
        self._care = 1.0 if target.identity != self._thought else max(0.5 * self._care, _MOST_CARE)
        self._thought, self._axis_holds = target.identity, False
        self._thinks_at = state.time + _PREPARATION

    def _goal_error(self, target: Target, q: FloatArray) -> FloatArray:
        """Return how far each arm joint is from where it was thought to belong, over `_near`, (n − b,)."""
        return np.abs(self._goal - q)[self._base :] / self._near(target, q)

    def _near(self, target: Target, q: FloatArray) -> FloatArray:
        """Return how near is near enough for each arm joint, (n − b,) [rad]."""
        linear, angular = self._levers(q)
        return self._care * _NEAR * np.minimum(target.distance / linear, target.angle / angular)

    def _errors(self, goal: MotionGoal, target: Target, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far each axis is from where it belongs, (m,), and how near is near enough, (m,)."""
        errors, tolerances = np.zeros(self.channels.size), np.ones(self.channels.size)
        if goal.focus == "base" and self._base:
            turn = np.arctan2(np.sin(target.base[2] - q[2]), np.cos(target.base[2] - q[2]))
            errors[self.channels.base_slice] = turned([*(target.base[:2] - q[:2]), turn], -q[2])
            near = [target.distance, target.distance, target.angle]
            tolerances[self.channels.base_slice] = 0.5 * np.array(near)
        else:
            errors[self._arm] = self._goal[self._base :] - q[self._base :]
            tolerances[self._arm] = self._near(target, q)
        return errors, tolerances

    def _levers(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far [m] and how much [rad] each arm joint moves the hand per radian, (n − b,) each."""
        jacobian = self._model.jacobian(q)[:, self._base :]
        return np.maximum(np.linalg.norm(jacobian[:3], axis=0), 0.05), np.linalg.norm(jacobian[3:], axis=0)

    def _fastest(self, target: Target, q: FloatArray) -> FloatArray:
        """Return the largest speed of each axis: full stick, and no faster than the hand may go, (m,)."""
        speeds = self.full.copy()
        linear, _ = self._levers(q)
        speeds[self._arm] = np.minimum(speeds[self._arm], target.pace * self._gains.hand_speed / linear)
        return speeds
