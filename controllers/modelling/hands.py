"""Where a hand points, and the fingers that a URDF has below it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import FloatArray
from handrail.controllers.modelling.clouds import LinkCloud, body_frame, urdf_clouds
from handrail.controllers.robot.model import read_urdf, twist_of
from handrail.controllers.robot.parts import Arm

_NEAR = 0.01  # of a hand's frame to its joint, where that does not say which way it points [m]
_ROLLS = 0.3  # least share of that way along the axis of a joint by which the hand rolls
_PAD = 0.35  # of a finger, from its tip to where it holds a thing
_END = 0.02  # of a finger: its last part [m]
_LEAST = 1e-3  # by which fingers move apart [m]
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of a finger's way, at which it is looked at
_AIR = 0.003  # of the box around the fingers [m]


class HandFinder:
    """Looks at a URDF with all its joints.

    Args:
        arm: the URDF.
        moving: joints of the chains to the hands.
    """

    def __init__(self, arm: Arm, moving: Sequence[str]) -> None:
        self.model = read_urdf(arm, mimic=True)
        collision, visual = urdf_clouds(arm.urdf, arm.mesh_root, arm.prefix)
        self._links, self._moving = list((visual | collision).values()), set(moving)

    def fingers(self, frame: str) -> list[set[int]]:
        """Return the joints of each finger: those that a joint carries on the body of a hand's frame."""
        model, body = self.model, body_frame(self.model, frame).parentJoint
        numbers = range(1, model.njoints)
        roots = [j for j in numbers if model.parents[j] == body and model.names[j] not in self._moving]
        return [{j for j in numbers if root in model.supports[j]} for root in roots]

    def axes(self, frame: str) -> FloatArray:
        """Return the hand's axes in its frame, as columns, (3, 3): z points where the hand does.

        The axis of the frame nearest to the way from the last joint, or from the middle of what that carries;
        where the hand can roll about that, to the joint's axis.
        """
        on = body_frame(self.model, frame)
        placement, joint, away = on.placement, on.parentJoint, on.placement.translation
        if np.linalg.norm(away) < _NEAR:
            carried = [link.triangles.reshape(-1, 3) for link in self._links if link.joint == joint]
            back = np.vstack(carried).mean(axis=0) if carried else -placement.rotation[:, 2]
            away = placement.translation - back
        turn = twist_of(self.model, joint)[1]
        if abs(turn @ away) > _ROLLS * np.linalg.norm(away):
            away = turn * (turn @ away)
        along = placement.rotation.T @ away
        axis = int(np.argmax(np.abs(along)))
        z, x = np.eye(3)[axis] * np.sign(along[axis]), np.eye(3)[(axis + 1) % 3]
        return np.column_stack([x, np.cross(z, x), z])

    def finger_clouds(self, frame: str, share: float) -> list[list[LinkCloud]]:
        """Return what each finger fills in a hand's frame, joints from nearest to 0 to farthest."""
        model, data, q = self.model, self.model.createData(), pin.neutral(self.model)
        ends = np.sort([model.lowerPositionLimit, model.upperPositionLimit], axis=0)
        farther = np.abs(ends).argmax(axis=0)
        joints = zip(list(model.names)[1:], model.joints[1:], strict=True)
        free = [joint.idx_q for name, joint in joints if name not in self._moving]
        near, far = (ends[end, np.arange(model.nq)][free] for end in (1 - farther, farther))
        q[free] = near + share * (far - near)
        pin.framesForwardKinematics(model, data, q)
        hand = data.oMf[model.getFrameId(frame, pin.FrameType.BODY)].inverse()
        fingers = [[link for link in self._links if link.joint in each] for each in self.fingers(frame)]
        return [[link.moved(0, hand * data.oMi[link.joint]) for link in each] for each in fingers if each]

    def gripper(self, frame: str, axes: FloatArray) -> tuple[dict[str, Any], dict[str, Any]] | None:
        """Return a gripper and the box around its fingers, as a description says them.

        Two fingers slide, or turn by as much as their tips move apart; None where there are not two.
        """
        way = [[_points(finger) for finger in self.finger_clouds(frame, share)] for share in SHARES]
        ends = [way[0], way[-1]]
        if len(ends[0]) != 2:
            return None
        across = np.eye(3) - np.outer(axes[:, 2], axes[:, 2])
        ends.sort(key=lambda each: np.linalg.norm(across @ (_tip(each[1], axes) - _tip(each[0], axes))))
        shut, apart = (across @ (_tip(right, axes) - _tip(left, axes)) for left, right in ends)
        stroke = float(np.linalg.norm(apart) - np.linalg.norm(shut))
        if not stroke > _LEAST:
            return None
        x = apart / np.linalg.norm(apart)
        rotation = np.column_stack([x, np.cross(axes[:, 2], x), axes[:, 2]])
        left, right = (points @ rotation for points in ends[1])
        both = np.vstack([points @ rotation for each in way for points in each])
        lower, upper = both.min(axis=0) - _AIR, both.max(axis=0) + _AIR
        tip, root = upper[2] - _AIR, lower[2] + _AIR
        middle = (_tip(left, np.eye(3)) + _tip(right, np.eye(3)))[:2] / 2
        sides = [np.ptp(points[points[:, 2] > tip - _END], axis=0) for points in (left, right)]
        width, depth = np.clip(np.mean(sides, axis=0)[:2], (0.008, 0.008), (0.03, 0.04))
        size = np.array([width, depth, min(tip - root, 0.12)])
        around = np.array([stroke / 2 + width, depth / 2]) + _AIR
        lower[:2], upper[:2] = np.minimum(lower[:2], middle - around), np.maximum(upper[:2], middle + around)
        place = {"rpy": pin.rpy.matrixToRpy(rotation)}
        origin = np.array([*middle, root - 0.01])
        effort = float(self.model.effortLimit[self.model.joints[min(self.fingers(frame)[0])].idx_v])
        sizes = {"finger_size": size, "stroke": stroke, "tip": tip - origin[2], "speed": stroke / 0.75}
        drive = {"mass": 0.001, "finger_mass": 0.03, "force": np.clip(effort, 10.0, 60.0), "friction": 1.2}
        gripper = {"frame": frame, "translation": rotation @ origin} | place | sizes | drive
        pad = rotation @ [*middle, tip - _PAD * size[2]]
        box = {"box": upper - lower, "at": rotation @ (lower + upper) / 2} | place
        return {"translation": pad, "gripper": gripper} | place, box


def _points(links: Sequence[LinkCloud]) -> FloatArray:
    return np.vstack([link.triangles.reshape(-1, 3) for link in links])


def _tip(points: FloatArray, axes: FloatArray) -> FloatArray:
    """Return the middle of the last part of a finger, (3,)."""
    along = points @ axes[:, 2]
    return points[along > along.max() - _END].mean(axis=0)
