"""One axis at a time: the operator picks a joint, drives it where it seems to belong, picks the next."""

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.input_map import InputMap
from handrail.collect.operators.scripted.placement import REACHED, arm_solutions, nearest
from handrail.collect.operators.scripted.steering import MotionGoal, Target, base_errors
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.controller import State
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import Pose, RobotModel

_NEAR = 0.35  # share of the tolerance that one axis may use up
_MOST_CARE = 0.1
PREPARATION = 1.35  # of the mind before it thinks again: M of the keystroke-level model [s]
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
    at_start = nearest(collision, q)
    for there, error in arm_solutions(model, q, goal):
        kept = min(clear, 0.9 * at_start, 0.9 * nearest(collision, there))
        preferred = sorted(arm, key=lambda index: -abs(there[index] - q[index]))
        order = clear_order(collision, q, there, preferred, kept) if kept > 0.0 else []
        share = len(order) / len(arm) - (error > REACHED)
        if share > most:
            best, most = (there, order), share
        if share == 1.0:
            break
    return best


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
            following = [*moved, joint]
            if joint in moved or frozenset(following) in seen:
                continue
            free = sweep_clearance(collision, now, joint, goal[joint] - now[joint]) >= clear
            if free and search(following):
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
    return nearest(collision, path)


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
        self._thought, self._thinks_at = b"", -np.inf
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
                values[axis] = self._push(goal.target, axis, errors[axis] - self._left, state.q)
        return np.arange(self.channels.size) == (self._axis or 0), values

    def _push(self, target: Target, axis: int, way: float, q: FloatArray) -> float:
        """Return the speed of an axis on its way, of a stick that is pushed; no faster than the hand may."""
        fastest = self.full[axis]
        if axis >= self._arm.start:
            lever = self._levers(q)[0][axis - self._arm.start]
            fastest = min(fastest, target.pace * self._gains.hand_speed / lever)
        slowest = min(self._least * self.full[axis], fastest)
        return float(np.sign(way) * np.clip(self._gains.gain * abs(way), slowest, fastest))

    def _choose(
        self, target: Target, errors: FloatArray, tolerances: FloatArray, q: FloatArray
    ) -> int | None:
        """Return the axis to push: the same until it is where it shall be, then another; None rests."""
        axis = self._axis
        if self._axis_holds and axis is not None and abs(errors[axis] - self._left) > tolerances[axis]:
            return axis
        best, widest = None, -np.inf
        for index, share in self._options(target, errors, np.abs(errors) / tolerances, q):
            clear = _CLEAR  # of the base: the script says where to drive
            if index >= self._arm.start:
                way = share * errors[index]
                clear = min(sweep_clearance(self._collision, q, self._coordinate(index), way), _CLEAR)
            if clear > widest:
                best, widest = (index, share), clear
            if clear >= _CLEAR:
                break
        if best is None:
            return None
        index, share = best
        self._axis_holds, self._axis, self._left = True, index, (1.0 - share) * errors[index]
        return index

    def _options(
        self, target: Target, errors: FloatArray, off: FloatArray, q: FloatArray
    ) -> list[tuple[int, float]]:
        """Return the axes and shares of their ways that matter, the best first.

        In the order thought of, then the farthest off; all of the way before a part of it. Where the hand
        must not lean, only what keeps it upright enough, or straightens it most if nothing does.
        """
        rank = {index: place for place, index in enumerate(self._order)}
        matter = np.flatnonzero(off > 1.0).tolist()
        candidates = sorted(matter, key=lambda index: (rank.get(index, len(rank)), -off[index]))
        shares = _SHARES if np.isinf(target.tilt) else _SMALL_SHARES
        options = [(index, share) for share in shares for index in candidates if share * off[index] > 1.0]
        if np.isinf(target.tilt):
            return options
        lean = {
            (index, share): self._lean(target, index, float(share * errors[index]), q)
            for index, share in options
        }
        upright = [option for option in options if lean[option] <= target.tilt]
        return upright or sorted(options, key=lambda option: lean[option])

    def _coordinate(self, axis: int) -> int:
        """Return which generalised coordinate an axis moves."""
        return axis - self.channels.joint_slice.start if axis >= self._arm.start else axis

    def _lean(self, target: Target, axis: int, way: float, q: FloatArray) -> float:
        """Return how far the hand leans from the target's axis after an axis' motion [rad]."""
        there = q.copy()
        there[self._coordinate(axis)] += way
        upright = self._model.pose(there).rotation[:, 2] @ target.hand.rotation[:, 2]
        return float(np.arccos(np.clip(upright, -1.0, 1.0)))

    def _think(self, target: Target, state: State) -> None:
        """Work out which joints would do it, for a new target, or when they did not."""
        q, known = state.q, target.identity == self._thought
        off = np.abs(self._goal - q)[self._base :] / self._near(target, q)
        if known and not (np.all(off < 1.0) and state.time >= self._thinks_at):
            return
        self._goal, order = plan_joints(self._model, self._collision, q, target.hand, _CLEAR)
        self._order = [self.channels.joint_slice.start + joint for joint in order]
        self._care = max(0.5 * self._care, _MOST_CARE) if known else 1.0
        self._thought, self._axis_holds = target.identity, False
        self._thinks_at = state.time + PREPARATION

    def _errors(self, goal: MotionGoal, target: Target, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far each axis is from where it belongs, (m,), and how near is near enough, (m,)."""
        errors, tolerances = np.zeros(self.channels.size), np.ones(self.channels.size)
        if goal.focus == "base" and self._base:
            errors[self.channels.base_slice] = turned(base_errors(q, target.base), -q[2])
            tolerances[self.channels.base_slice] = 0.5 * np.array([*[target.distance] * 2, target.angle])
        else:
            errors[self._arm] = (self._goal - q)[self._base :]
            tolerances[self._arm] = self._near(target, q)
        return errors, tolerances

    def _near(self, target: Target, q: FloatArray) -> FloatArray:
        """Return how near is near enough for each arm joint, (n − b,) [rad]."""
        linear, angular = self._levers(q)
        return self._care * _NEAR * np.minimum(target.distance / linear, target.angle / angular)

    def _levers(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far [m] and how much [rad] each arm joint moves the hand per radian, (n − b,) each."""
        jacobian = self._model.jacobian(q)[:, self._base :]
        return np.maximum(np.linalg.norm(jacobian[:3], axis=0), 0.05), np.linalg.norm(jacobian[3:], axis=0)
