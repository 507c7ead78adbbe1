"""What a controller keeps from: the robot's pairs of shapes among what stands around now."""

from dataclasses import dataclass, replace

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.shape import Obstacle


@dataclass(frozen=True)
class Surroundings:
    """The obstacles of a controller, which come and go.

    Attributes:
        collision: the pairs that keep apart; of the last scene that made sense.
        make_sense: whether what was seen last does; else the robot has to brake.
    """

    collision: CollisionModel
    make_sense: bool = True

    def among(self, obstacles: tuple[Obstacle, ...]) -> "Surroundings":
        """Return the surroundings with the obstacles as they are now."""
        try:
            return Surroundings(self.collision.among(obstacles))
        except HandrailError:
            return replace(self, make_sense=False)
