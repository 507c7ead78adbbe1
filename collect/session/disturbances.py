"""Disturbances at work in an episode: late observations, other pictures, pushes, a start elsewhere."""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from handrail.collect.operators.operator import EpisodeEvent, Operator, View
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.scene import FrozenArrays, Scene, SceneObject
from handrail.collect.world.task import Start, Task
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import RobotModel

_STREAM = 2  # of the episode's seed; 1 is the operator's
_FIRST, _PAUSE = (0.5, 2.0), (2.5, 5.0)  # when the first comes, and from one to the next [s]
_DURATION = (0.15, 0.25)  # [s]
_BASE_EXCESS = 0.4  # force on the base over what its servos hold, a share of it
_HAND_HELD, _HAND_EXCESS = 0.30, 0.25  # force on the hand over the arm's largest torque [1/m]
_ROUNDING = 1e-9  # of the distance of what the hand holds, which comes along [m]
_START_CLEARANCE = 0.08  # of the start from everything, unless it was nearer before [m]
_ATTEMPTS = 100


class DelayedOperator:
    """Shows another operator each moment k control periods late; an operator.

    What they ask for arrives at once: the intent carries the time at which it was asked. Before the k-th
    period they see the beginning.

    Args:
        operator: whoever steers.
        periods: k, 0 or more.
    """

    def __init__(self, operator: Operator, periods: int) -> None:
        self._operator, self._periods = operator, periods

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""
        self._views = deque([view] * self._periods)
        self._operator.reset(view, rng)

    def act(self, view: View) -> Intent | EpisodeEvent:
        """Return what is asked for now, after what was seen k periods ago."""
        self._views.append(view)
        asked = self._operator.act(self._views.popleft())
        return asked if isinstance(asked, EpisodeEvent) else replace(asked, time=view.state.time)


class OtherPictures:
    """Shows another operator other pictures than those of the episode; an operator.

    Args:
        operator: whoever steers.
        other: the same robot elsewhere: it is shown in the scene of another episode, where it is in its own.
            Without, pictures are black.
    """

    def __init__(self, operator: Operator, other: HandrailEnv | None) -> None:
        self._operator, self._other = operator, other

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""
        if self._other:
            self._other.reset(seed=int(rng.integers(2**32)))
        self._operator.reset(self._changed(view), rng)

    def act(self, view: View) -> Intent | EpisodeEvent:
        """Return what is asked for now."""
        return self._operator.act(self._changed(view))

    def _changed(self, view: View) -> View:
        pictures = view.observation["pixels"]
        if self._other:
            self._other.simulation.show(view.state.q)
            pictures = self._other.pictures(tuple(pictures))
        else:
            pictures = {name: np.zeros_like(each) for name, each in pictures.items()}
        return replace(view, observation={**view.observation, "pixels": pictures})


@dataclass(frozen=True)
class Push(FrozenArrays):
    """A force that acts for a moment."""

    start: float  # when it begins [s]
    end: float  # when it ends [s]
    hand: bool  # whether it acts at the tool point, else on the base's centre
    direction: FloatArray  # in the world, (3,); horizontal on the base


def sample_pushes(seed: int, time_limit: float) -> tuple[Push, ...]:
    """Draw the pushes of an episode; its seed alone says when, where and which way.

    Args:
        seed: of the episode.
        time_limit: its longest duration [s].
    """
    rng = np.random.default_rng([seed, _STREAM])
    pushes, start = [], rng.uniform(*_FIRST)
    while start < time_limit:
        hand = bool(rng.random() < 0.5)
        direction = rng.normal(size=3)
        if not hand:
            direction[2] = 0.0
        direction /= np.linalg.norm(direction)
        pushes.append(Push(start, start + rng.uniform(*_DURATION), hand, direction))
        start += rng.uniform(*_PAUSE)
    return tuple(pushes)


class Pusher:
    """Pushes the robot at moments that the seed says; a disturbance.

    The servos hold velocities, so a push moves the robot only beyond what they hold: with size s the base is
    pushed with `(1 + 0.4 s)` times its servos' force, the hand with `(0.30 + 0.25 s)` N for each N m of the
    arm's largest torque.

    Measured on the Ridgeback with UR10, at rest at home, s = 1, over 40 seeds: a push moves the base by 1 to
    18 cm (median 7), the hand by 3 to 19 cm (median 5), depending on direction and duration. Other robots'
    bases move alike, their hands by 0.2 to 0.6 cm. Of several hands it is the one that does the task.

    Args:
        size: s.
    """

    def __init__(self, size: float) -> None:
        self._size = size

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Draw the pushes of an episode."""
        self._simulation = env.simulation
        self._pushes = sample_pushes(seed, env.task.time_limit)
        effort, base = env.model.description.limits.effort, len(env.model.description.base.joints)
        held = float(np.min(effort[: min(base, 2)])) if base else 0.0  # one that stands fixed: at the hand
        self._base = held * (1.0 + _BASE_EXCESS * self._size)
        channels = Channels.of(env.model.description)
        arm = channels.arm(env.model.number)[channels.joint_slice]
        self._hand = float(np.max(effort[arm])) * (_HAND_HELD + _HAND_EXCESS * self._size)

    def act(self) -> None:
        """Set the forces of the control period that begins now."""
        now, forces = self._simulation.time, {True: np.zeros(3), False: np.zeros(3)}
        for push in self._pushes:
            if push.start <= now < push.end:
                forces[push.hand] += push.direction * (self._hand if push.hand else self._base)
        self._simulation.push(forces[False], forces[True])


def sample_shifted(task: Task, size: float, model: RobotModel, rng: np.random.Generator) -> Start:
    """Draw a task's beginning, then where the robot is instead; scene and goal of a seed stay what they are.

    With size s the base begins `s/2` to s metres away in any direction and turned by up to s rad, each joint
    of the arm by up to `s/2` rad. A held object comes along, and the arm then stays as it is. The
    start is inside the limits and keeps 8 cm from everything; where there is no room the shift becomes
    smaller.

    Args:
        task: which.
        size: s [m, rad].
        model: of the robot.
        rng: drawn from.
    """
    start = task.sample(model, rng)
    least = np.minimum(_distances(model, start), _START_CLEARANCE) - _ROUNDING
    for attempt in range(_ATTEMPTS):
        step = _draw(len(model.description.base.joints), model.size, size * (1.0 - attempt / _ATTEMPTS), rng)
        moved = _moved(model, start, step)
        if _within_limits(model, moved.q) and np.all(_distances(model, moved) >= least):
            return moved
    return start


def _draw(base: int, joints: int, size: float, rng: np.random.Generator) -> FloatArray:
    """Return a displacement of the configuration, (n,)."""
    step = rng.uniform(-size / 2, size / 2, joints)
    direction, distance = rng.uniform(-np.pi, np.pi), rng.uniform(size / 2, size)
    turn = rng.uniform(-1, 1)
    step[:base] = np.array([np.cos(direction), np.sin(direction), 0.0])[:base] * distance
    if base == 3:
        step[2] = size * turn
    return step


def _moved(model: RobotModel, start: Start, step: FloatArray) -> Start:
    """Return the start with the robot displaced; what it holds moves with the hand."""
    if not any(width is not None for width in start.grip):
        return replace(start, q=start.q + step)
    q = start.q + np.where(np.arange(model.size) < len(model.description.base.joints), step, 0.0)
    before, after = model.pose(start.q), model.pose(q)
    turn = after.rotation @ before.rotation.T

    def carried(item: SceneObject) -> SceneObject:
        if not item.movable:
            return item
        position = after.position + turn @ (item.position - before.position)
        return replace(item, position=position, rotation=turn @ item.rotation)

    return replace(start, q=q, scene=Scene(tuple(map(carried, start.scene.objects)), start.scene.view))


def _within_limits(model: RobotModel, q: FloatArray) -> bool:
    limits = model.description.limits
    return bool(np.all((limits.position_lower < q) & (q < limits.position_upper)))


def _distances(model: RobotModel, start: Start) -> FloatArray:
    """Return the signed distance of every pair, things that can be moved included [m], (P,)."""
    solid = tuple(item.obstacle() for item in start.scene.objects if not item.ghost)
    return CollisionModel(model, solid).values(start.q[None, :])[0]
