"""The reinforcement-learning baseline as a controller: a learned base, damped least squares on the arm."""

import numpy as np
import pinocchio as pin

from handrail.collect.world.tasks.goal_reaching import STEP
from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.arm_completion import ArmCompletion, clamp_twist
from handrail.controllers.baselines.twist_completion import TwistController
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Obstacle
from handrail.policies.rl.observation import ACTION_SIZE, RigidPose, base_velocity, check_robot, observe
from handrail.policies.rl.policy import Actor

_AHEAD = 5.0  # without a goal, where the present twist leads in this time is the goal [s]


class RlController(TwistController):
    """The reinforcement-learning baseline; a controller for twists of the tool, at about 33 Hz.

    Clipped to the robot's limits; brakes when an input is invalid or stale and when other channels are
    commanded. It knows no obstacles: distances are measured and reported, not kept. It remembers the pose
    that the twists so far should have led to, and the action before.

    Args:
        model: of the robot, a Ridgeback with a UR10.
        period: of the control loop [s]; the actor was trained with 0.03 s.
        actor: the trained network; the one that comes with Handrail by default.
    """

    def __init__(self, model: RobotModel, period: float = STEP, actor: Actor | None = None) -> None:
        check_robot(model)
        self._arm, self._actor = ArmCompletion(model), actor or Actor.load()
        super().__init__(model, self._velocity, period)

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the episode, its goal too; take the obstacles whose distance is reported."""
        self._start: FloatArray | None = None
        self._desired: RigidPose | None = None
        self._goal: RigidPose | None = None
        self._action = np.zeros(ACTION_SIZE)
        super().reset(obstacles)

    def aim(self, goal: Pose) -> None:
        """Say where the twists of this episode lead; without it, the present twist is followed onward."""
        self._goal = (goal.position, goal.rotation)

    def _velocity(
        self, q: FloatArray, previous: FloatArray, twist: FloatArray, duration: float
    ) -> FloatArray:
        """Return the whole-body velocity that completes a twist, (n,) [m/s, rad/s]."""
        pose = self._model.pose(q)
        current = pose.position, pose.rotation
        self._start = q[:3].copy() if self._start is None else self._start
        desired = self._desired or current
        poses = current, desired, self._goal or _moved(desired, twist, _AHEAD)
        observation = observe(q, self._start, clamp_twist(twist), poses, self._action)
        self._action = np.asarray(self._actor(observation), dtype=np.float64)
        self._desired = _moved(desired, twist, duration)
        base = base_velocity(self._action, q[2])
        return self._arm.velocity(q, previous, base, clamp_twist(twist), duration)


def _moved(pose: RigidPose, twist: FloatArray, duration: float) -> RigidPose:
    """Return where a pose is after a constant twist, world-aligned at its point."""
    position, rotation = pose
    return position + duration * twist[:3], pin.exp3(duration * twist[3:]) @ rotation
