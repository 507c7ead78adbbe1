"""The protocol of an operator, and what it sees."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Protocol

import numpy as np

from handrail.collect.world.task import TaskState
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import Pose


@dataclass(frozen=True)
class View:
    """The observation of an operator."""

    state: State  # of the robot
    task: TaskState  # the truth of this moment
    observation: Mapping[str, Any] = field(default_factory=dict)
    """The recorded observation: `agent_pos`, `environment_state`, and `pixels` by camera."""
    grippers: tuple[float, ...] = ()
    """The last command of each gripper: 0 open to 1 closed."""

    @property
    def tool(self) -> Pose:
        """Pose of the tool point."""
        return self.task.tool


class EpisodeEvent(StrEnum):
    """A person's word on the episode instead of steering; scripts and policies never do."""

    SUCCESS = "success"  # it is done
    FAILURE = "failure"  # it is done, and went wrong
    DISCARD = "discard"  # throw it away, go on with another one
    RESTART = "restart"  # throw it away, begin the same one again
    QUIT = "quit"  # throw it away, and record no more
    UNDO = "undo"  # back to where they went on last, or to the beginning; what came after is forgotten
    PAUSE = "pause"  # stand still; said at every call until it goes on

    @property
    def judges(self) -> bool:
        """Whether it ends an episode that is kept."""
        return self in (EpisodeEvent.SUCCESS, EpisodeEvent.FAILURE)

    @property
    def drops(self) -> bool:
        """Whether it ends an episode that is not kept, at once."""
        return self in (EpisodeEvent.DISCARD, EpisodeEvent.RESTART, EpisodeEvent.QUIT)


class Operator(Protocol):
    """A source of intents: a script, a person, a trained policy."""

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""

    def act(self, view: View) -> Intent | EpisodeEvent:
        """Return the intent now, or what becomes of the episode."""
        ...
