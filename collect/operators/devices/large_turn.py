"""Large turns by joints: the operator thinks of where the joints belong, and brings them straight there."""

import numpy as np

from handrail.collect.operators.devices.arm_solutions import straight_solution
from handrail.collect.operators.human.motion_goal import Target
from handrail.collect.operators.human.steering import Gains
from handrail.collect.operators.operator import View
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.numerics.rotation import rotation_vector
from handrail.controllers.robot.inverse_kinematics import arm_configuration
from handrail.controllers.robot.model import RobotModel

_CLEAR = 0.03  # what the motion shall keep clear [m]
_EXACTLY = 1e-3  # how well one knows where joints belong [m, rad]


class LargeTurn:
    """Turns the hand by joints, where following the hand would fold the arm into itself.

    `q̇ = s k_h (q_ik − q)`, with s such that neither hand nor joints move faster than at full stick. Which of
    the inverse kinematics' solutions it is, is thought of once a target: the nearest that is clear. Where
    it is follows the pose as the operator sees it from moment to moment.

    Args:
        model: of the robot.
        gains: full stick of hand and joints.
        large: turn of the hand from which on it matters how the arm gets there [rad].
        view: of the scene, at the beginning of an episode.
    """

    def __init__(self, model: RobotModel, gains: Gains, large: float, view: View) -> None:
        self._model, self._gains, self._large = model, gains, large
        self._base = len(model.description.base_joints)
        self._collision = CollisionModel(model, view.task.obstacles)
        self._goal = view.state.q.copy()
        self._thought = b""

    def is_ahead(self, target: Target, q: FloatArray) -> bool:
        """Return whether the hand has to turn far to where a goal leads."""
        turn = target.hand.rotation @ self._model.pose(q).rotation.T
        return float(np.linalg.norm(rotation_vector(turn))) > self._large

    def arm_velocity(self, target: Target, q: FloatArray, base: FloatArray) -> FloatArray:
        """Return the velocity straight to where the arm's joints belong, (n − b,) [rad/s].

        Args:
            target: where the goal leads, as it is seen.
            q: joint positions, (n,).
            base: of the base, from where the operator thinks the hand reaches the target, (b,).
        """
        if target.identity != self._thought:
            start = np.concatenate([base, q[self._base :]])
            self._goal = straight_solution(self._model, self._collision, start, target.hand, _CLEAR)
            self._thought = target.identity
        else:
            before = np.concatenate([base, self._goal[self._base :]])
            self._goal = arm_configuration(self._model, before, target.hand, _EXACTLY)[0]
        velocity = self._gains.gain * (self._goal - q)[self._base :]
        hand = self._model.jacobian(q)[:, self._base :] @ velocity
        fastest = target.pace * self._gains.full[[0, 3]]  # of the hand, and how fast it may turn
        excess = np.array([np.linalg.norm(hand[:3]), np.linalg.norm(hand[3:])]) / fastest
        excess_of_joints = np.max(np.abs(velocity)) / self._gains.joint_rate
        return velocity / max(1.0, float(np.max(excess)), float(excess_of_joints))
