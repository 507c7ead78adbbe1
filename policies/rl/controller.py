"""The reinforcement-learning baseline as a controller: a learned base, damped least squares on the arm."""

import numpy as np
import pinocchio as pin

from handrail.collect.tasks.goal_reaching import STEP
from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.arm_completion import ArmCompletion, clamp_twist
from handrail.controllers.baselines.reactive import ReactiveController
from handrail.controllers.baselines.twist_completion import twist_controller
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Obstacle
from handrail.policies.rl.observation import ACTION_SIZE, RigidPose, Situation, base_velocity, observe
from handrail.policies.rl.policy import Actor

_AHEAD = 5.0  # without a goal, where the present twist leads in this time is the goal [s]


class RlCompletion:
    """Completes a tool twist by a trained actor; a completion with a memory.

    It remembers the pose that the twists so far should have led to, and the action before.

    Args:
        model: of the robot; its base must be planar and its arm must have six joints.
        actor: which base twist to drive; the one that comes with Handrail by default.

    Raises:
        HandrailError: the robot is another kind.
    """

    def __init__(self, model: RobotModel, actor: Actor | None = None) -> None:
        if len(model.description.base_joints) != 3 or model.size != 9:
            raise HandrailError(
                f"robot {model.description.name} of the reinforcement-learning baseline: "
                f"expected a planar base and six arm joints, got {', '.join(model.joints)}"
            )
        self._model = model
        self._arm = ArmCompletion(model)
        self._actor = actor or Actor.load()
        self.reset()

    def reset(self) -> None:
        """Forget the episode: desired pose, goal, previous action."""
        self._start: FloatArray | None = None
        self._desired: RigidPose | None = None
        self._goal: RigidPose | None = None
        self._action = np.zeros(ACTION_SIZE)

    def aim(self, goal: Pose) -> None:
        """Say where the twists of this episode lead."""
        self._goal = (goal.position, goal.rotation)

    def __call__(self, q: FloatArray, previous: FloatArray, twist: FloatArray, duration: float) -> FloatArray:
        """Return the whole-body velocity, (n,) [m/s, rad/s].

        Args:
            q: generalised coordinates, (n,).
            previous: velocity commanded last, (n,).
            twist: asked of the tool, (v, ω), world-aligned, (6,) [m/s, rad/s].
            duration: of the step [s].
        """
        pose = self._model.pose(q)
        current = pose.position, pose.rotation
        self._start = q[:3].copy() if self._start is None else self._start
        desired = self._desired or current
        situation = Situation(
            q=q,
            start=self._start,
            twist=clamp_twist(twist),
            current=current,
            desired=desired,
            goal=self._goal or _moved(desired, twist, _AHEAD),
            previous=self._action,
        )
        self._action = np.asarray(self._actor(observe(situation)), dtype=np.float64)
        self._desired = _moved(desired, twist, duration)
        base = base_velocity(self._action, q[2])
        return self._arm.velocity(q, previous, base, clamp_twist(twist), duration)


class RlController:
    """The reinforcement-learning baseline; a controller for twists of the tool, at about 33 Hz.

    Clipped to the robot's limits; brakes when an input is invalid or stale and when other channels are
    commanded. It knows no obstacles: distances are measured and reported, not kept.

    Args:
        model: of the robot.
        actor: the trained network; the one that comes with Handrail by default.
        period: of the control loop [s]; the actor was trained with 0.03 s.
        intent_timeout: age from which an intent is stale [s].
    """

    def __init__(
        self,
        model: RobotModel,
        actor: Actor | None = None,
        period: float = STEP,
        intent_timeout: float = 0.25,
    ) -> None:
        self._completion = RlCompletion(model, actor)
        self._inner: ReactiveController = twist_controller(model, self._completion, period, intent_timeout)

    @property
    def channels(self) -> Channels:
        """The robot's command channels."""
        return self._inner.channels

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the episode, its goal too; take the obstacles whose distance is reported."""
        self._completion.reset()
        self._inner.reset(obstacles)

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take where the obstacles are now, and what the hand holds."""
        self._inner.update_scene(obstacles)

    def aim(self, goal: Pose) -> None:
        """Say where the twists of this episode lead; without it, the present twist is followed onward."""
        self._completion.aim(goal)

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from now on."""
        return self._inner.update(state, intent)


def _moved(pose: RigidPose, twist: FloatArray, duration: float) -> RigidPose:
    """Return where a pose is after a constant twist, world-aligned at its point."""
    position, rotation = pose
    return position + duration * twist[:3], pin.exp3(duration * twist[3:]) @ rotation
