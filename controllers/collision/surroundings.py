"""What a controller keeps from: the robot's pairs of shapes among what stands around now."""

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle


class Surroundings:
    """The obstacles of a controller, which come and go.

    Args:
        model: of the robot.
        obstacles: at the beginning of an episode.

    Attributes:
        collision: the pairs that keep apart; of the last scene that made sense.
        make_sense: whether what was seen last does; else the robot has to brake.

    Raises:
        HandrailError: two things share a name, or one is held by a frame that the robot lacks.
    """

    def __init__(self, model: RobotModel, obstacles: tuple[Obstacle, ...] = ()) -> None:
        self.collision = CollisionModel(model, obstacles)
        self.make_sense = True

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> bool:
        """Take the obstacles as they are now; return whether there are other pairs than before."""
        before = self.collision
        try:
            self.collision = before.among(obstacles)
        except HandrailError:
            self.make_sense = False
        else:
            self.make_sense = True
        return self.collision is not before
