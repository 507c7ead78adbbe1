"""The interface of a task: it samples an episode, names its state, judges the outcome."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from handrail.collect.world.scene import FrozenArrays, Scene, SceneObject
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import check_known
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Obstacle

_AWAY = 0.08  # [m]
OPEN = 0.8  # share of the stroke from which a gripper is open


@dataclass(frozen=True)
class Start(FrozenArrays):
    """A sampled beginning."""

    scene: Scene  # everything around the robot
    q: FloatArray  # where the robot starts, (n,)
    goal: Pose | None = None  # of the tool, if there is one
    grip: tuple[float | None, ...] = ()
    """Widths of what grippers already hold [m], of the hand that does it first; open where None is said, or
    nothing."""


@dataclass(frozen=True)
class TaskState:
    """The truth of a moment, for judging an outcome and for scripted operators."""

    time: float  # since the episode began [s]
    tools: tuple[Pose, ...]  # of each hand's tool point
    openings: tuple[float, ...]  # of each hand's gripper, 0 closed to 1 open
    start: Start  # how the episode began: scene with the objects' shapes, goal
    poses: Mapping[str, Pose]  # of every object of the scene, by name
    still: frozenset[str] = frozenset()  # names of the movable objects that are at rest
    stable: bool = True  # whether the physics went well so far
    scale: float = 1.0  # of the robot's world
    hand: int = 0  # number of the hand that does it

    @property
    def tool(self) -> Pose:
        """The pose of the tool point of the hand that does the task."""
        return self.tools[self.hand]

    @property
    def pair(self) -> Pose:
        """Half-way between the tool points, turned as the hand that does the task."""
        return Pose(np.mean([tool.position for tool in self.tools], axis=0), self.tool.rotation)

    @property
    def opening(self) -> float:
        """How far that hand's gripper is open."""
        return self.openings[self.hand]

    @property
    def goal(self) -> Pose | None:
        """Where the tool has to go, if the task says so."""
        return self.start.goal

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The things that the robot must not touch, where they are now."""
        return self.start.scene.obstacles(self.time)

    def left_alone(self, held: Pose, middle: FloatArray, apart: float) -> bool:
        """Return whether two hands let go of a thing that they held so far apart along its y.

        Args:
            held: where the thing is.
            middle: half-way between the places to hold it, in its frame [m], (3,).
            apart: between those [m].
        """
        ways = [middle + [0.0, side * apart / 2, 0.0] for side in (1.0, -1.0)]
        places = [held.position + held.rotation @ way for way in ways]
        return all(self.let_go(place, hand) for place in places for hand in range(len(self.tools)))

    def let_go(self, place: FloatArray, hand: int | None = None) -> bool:
        """Return whether the gripper is open, and the tool point away from a place, (3,): by 8 cm · scale.

        Args:
            place: where it held [m].
            hand: which of the hands; that does the task by default.
        """
        hand = self.hand if hand is None else hand
        away = float(np.linalg.norm(self.tools[hand].position - place))
        return away >= _AWAY * self.scale and self.openings[hand] > OPEN

    def pose(self, name: str) -> Pose:
        """Return where an object is."""
        check_known("scene object", (name,), self.poses)
        return self.poses[name]

    def object(self, name: str) -> SceneObject:
        """Return an object as it was at the beginning, with its shape."""
        return self.start.scene.find(name)


@dataclass(frozen=True)
class Verdict:
    """How a task stands: success, a failure with its reason, or neither yet."""

    success: bool = False
    failure: str = ""

    @property
    def over(self) -> bool:
        """Whether the episode ends."""
        return self.success or bool(self.failure)


@dataclass(frozen=True)
class Aim:
    """A place that the hand is to be brought to now; a person is shown how far that is."""

    name: str  # of what is there
    position: FloatArray  # of the tool point [m], (3,)
    rotation: FloatArray | None = None  # world from tool, (3, 3); None where any will do
    distance: float = 0.0  # tolerance of the task's judge [m]; 0 where it has none
    angle: float = 0.0  # likewise [rad]


class Task(ABC):
    """A task: a frozen dataclass in its own file, with one entry in `collect/world/tasks/catalogue.py`."""

    description: str  # one sentence: what to do; LeRobot's `task` string
    time_limit: float  # time after which an episode has failed [s]
    stages: ClassVar[tuple[str, ...]] = ()
    """Names of the stages in which it is done, one after the other, if it has any."""
    parts: ClassVar[Mapping[str, str]] = {}
    """What has a place in the state and is a part of an object: by its name, the object's."""

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the numbers in `environment_state`, (k,)."""
        return ()

    @abstractmethod
    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Return the beginning of an episode."""

    def features(self, state: TaskState) -> FloatArray:
        """Return the `environment_state`, (k,), in [m], wxyz quaternions; finite, and cut to ± 100."""
        return np.zeros(0)

    @abstractmethod
    def outcome(self, state: TaskState) -> Verdict:
        """Judge a moment."""

    def aim(self, state: TaskState) -> Aim | None:
        """Return where the hand is to be brought at a moment, if the task says that."""
        return None

    def stage(self, state: TaskState) -> str:
        """Return which of the stages is to be done at a moment."""
        return ""


@dataclass(frozen=True)
class FixedTask(Task):
    """A task without anything random: how every episode begins, and a judge that says how it stands."""

    begin: Start
    judge: Callable[[TaskState], Verdict]
    time_limit: float  # [s]
    description: str = ""

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Return the beginning."""
        return self.begin

    def outcome(self, state: TaskState) -> Verdict:
        """Return what the judge says."""
        return self.judge(state)
