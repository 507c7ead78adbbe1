"""Where a hand points, and the fingers that a URDF has below it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import FloatArray
from handrail.controllers.modelling.clouds import urdf_geometry
from handrail.controllers.robot.model import read_urdf
from handrail.controllers.robot.parts import Arm
from handrail.controllers.robot.urdf import check_urdf

_NEAR = 0.01  # of a hand's frame to its joint, where that does not say which way it points [m]
_ROLLS = 0.3  # least share of that way along the axis of a joint by which the hand rolls
_PAD = 0.35  # of a finger, from its tip to where it holds a thing
_AIR = 0.003  # of the box around the fingers [m]


@dataclass(frozen=True)
class Fingers:
    """Two fingers in a hand's frame [m]."""

    rotation: FloatArray  # x across, z ahead, (3, 3)
    origin: FloatArray  # between their roots, (3,)
    size: FloatArray  # of one, (3,)
    stroke: float  # between them, open
    tip: float  # from the origin
    effort: float  # of their joint [N, N m]
    pad: FloatArray  # where they hold a thing, (3,)
    middle: FloatArray  # of the box around both, open and closed, (3,)
    sides: FloatArray  # of it, (3,)

    @property
    def rpy(self) -> FloatArray:
        """Roll, pitch and yaw of their axes [rad], (3,)."""
        return pin.rpy.matrixToRpy(self.rotation)

    @property
    def box(self) -> dict[str, Any]:
        """The shape around both, as a description says it."""
        return {"box": self.sides, "at": self.middle, "rpy": self.rpy}

    def entries(self, frame: str, shape: str) -> dict[str, Any]:
        """Return the gripper as a description says it."""
        place = {"frame": frame, "translation": self.origin, "rpy": self.rpy, "shape": shape}
        sizes = {
            "finger_size": self.size,
            "stroke": self.stroke,
            "tip": self.tip,
            "speed": self.stroke / 0.75,
        }
        force = float(np.clip(self.effort, 10.0, 60.0))
        return place | sizes | {"mass": 0.001, "finger_mass": 0.03, "force": force, "friction": 1.2}


def pointing(axes: FloatArray) -> str:
    """Return which way a hand's z axis points in its frame, such as +x."""
    index = int(np.argmax(np.abs(axes[:, 2])))
    return ("+" if axes[index, 2] > 0 else "−") + "xyz"[index]


class HandFinder:
    """Looks at a URDF with all its joints.

    Args:
        arm: the URDF.
        moving: joints of the chains to the hands.
    """

    def __init__(self, arm: Arm, moving: Sequence[str]) -> None:
        self.model = read_urdf(arm)
        self._data, self._neutral = self.model.createData(), pin.neutral(self.model)
        collision, visual = urdf_geometry(arm)
        self._geometry = [(joint, triangles.reshape(-1, 3)) for _, joint, triangles in collision or visual]
        self._moving = set(moving)
        self._mimics = {
            joint.get("name", ""): mimic
            for joint in check_urdf(arm.urdf).findall("joint")
            if (mimic := joint.find("mimic")) is not None
        }

    def fingers(self, frame: str) -> list[int]:
        """Return the joints on the body of a hand's frame that move none of the hands."""
        model, body = self.model, self._joint(frame)
        names = list(model.names)
        return [
            j for j in range(1, model.njoints) if model.parents[j] == body and names[j] not in self._moving
        ]

    def finger_joints(self, frame: str) -> set[str]:
        """Return the names of all joints of its fingers."""
        return {self.model.names[j] for finger in self.fingers(frame) for j in self._carried(finger)}

    def finger_links(self, frame: str) -> set[str]:
        """Return the links that its fingers carry."""
        below = {j for finger in self.fingers(frame) for j in self._carried(finger)}
        return {f.name for f in self.model.frames if f.parentJoint in below and f.type == pin.FrameType.BODY}

    def axes(self, frame: str) -> FloatArray:
        """Return the hand's axes in its frame, as columns, (3, 3): z points where the hand does.

        The axis of the frame nearest to the way from the last joint, or from the middle of what that carries;
        where the hand can roll about that, to the joint's axis.
        """
        placement = self._frame(frame).placement
        away = placement.translation
        if np.linalg.norm(away) < _NEAR:
            carried = [points for joint, points in self._geometry if joint == self._joint(frame)]
            away = placement.translation - (
                np.vstack(carried).mean(axis=0) if carried else -placement.rotation[:, 2]
            )
        data = self.model.joints[self._joint(frame)].createData()
        self.model.joints[self._joint(frame)].calc(data, np.zeros(1))
        turn = np.asarray(data.S).reshape(6)[3:]
        if abs(turn @ away) > _ROLLS * np.linalg.norm(away):
            away = turn * (turn @ away)
        along = placement.rotation.T @ away
        axis = int(np.argmax(np.abs(along)))
        z, x = np.eye(3)[axis] * np.sign(along[axis]), np.eye(3)[(axis + 1) % 3]
        return np.column_stack([x, np.cross(z, x), z])

    def gripper(self, frame: str, axes: FloatArray) -> Fingers | None:
        """Return a hand's two fingers in its frame.

        Both slide, or turn by as much as their tips move apart; None where there are not two.
        """
        fingers = [finger for finger in self.fingers(frame) if len(self._points(finger, frame, 0.0))]
        if len(fingers) != 2:
            return None
        ends = [[self._points(finger, frame, end) for finger in fingers] for end in (0.0, 1.0)]
        apart = [_tips(right, axes) - _tips(left, axes) for left, right in ends]
        widths = [float(np.linalg.norm(each - axes[:, 2] * (axes[:, 2] @ each))) for each in apart]
        closed, opened = sorted((0, 1), key=lambda end: widths[end])
        x = apart[opened] - axes[:, 2] * (axes[:, 2] @ apart[opened])
        x /= np.linalg.norm(x)
        rotation = np.column_stack([x, np.cross(axes[:, 2], x), axes[:, 2]])
        left, right = (points @ rotation for points in ends[opened])
        both = np.vstack([left, right, *(points @ rotation for points in ends[closed])])
        lower, upper = both.min(axis=0), both.max(axis=0)
        middle = (_tips(ends[opened][0], axes) + _tips(ends[opened][1], axes)) / 2 @ rotation
        origin = np.array([middle[0], middle[1], lower[2] - 0.01])
        sides = [np.ptp(points[points[:, 2] > upper[2] - 0.02], axis=0) for points in (left, right)]
        width, depth = np.clip(np.mean(sides, axis=0)[:2], (0.008, 0.008), (0.03, 0.04))
        size, stroke = (
            np.array([width, depth, min(upper[2] - lower[2], 0.12)]),
            widths[opened] - widths[closed],
        )
        reach = stroke / 2 + width + _AIR
        lower = np.minimum(lower - _AIR, [middle[0] - reach, middle[1] - depth / 2 - _AIR, np.inf])
        upper = np.maximum(upper + _AIR, [middle[0] + reach, middle[1] + depth / 2 + _AIR, -np.inf])
        effort = float(self.model.effortLimit[self.model.joints[fingers[0]].idx_v])
        tip = float(upper[2]) - _AIR
        pad, box = (
            [middle[0], middle[1], tip - _PAD * size[2]],
            (rotation @ (lower + upper) / 2, upper - lower),
        )
        sizes = size, float(stroke), tip - origin[2], effort
        return Fingers(rotation, rotation @ origin, *sizes, rotation @ pad, *box)

    def _frame(self, frame: str) -> pin.Frame:
        return self.model.frames[self.model.getFrameId(frame, pin.FrameType.BODY)]

    def _joint(self, frame: str) -> int:
        return self._frame(frame).parentJoint

    def _carried(self, joint: int) -> set[int]:
        return {j for j in range(1, self.model.njoints) if joint in self.model.supports[j]}

    def _points(self, finger: int, frame: str, end: float) -> FloatArray:
        """Return what a finger fills in a hand's frame with all fingers at an end of their travel, (k, 3)."""
        model, data = self.model, self._data
        pin.framesForwardKinematics(model, data, self._at(end))
        hand = data.oMf[model.getFrameId(frame, pin.FrameType.BODY)]
        carried = self._carried(finger)
        found = [(data.oMi[joint], points) for joint, points in self._geometry if joint in carried]
        placed = [points @ on.rotation.T + on.translation - hand.translation for on, points in found]
        return np.vstack([*placed, np.empty((0, 3))]) @ hand.rotation

    def _at(self, end: float) -> FloatArray:
        """Return the configuration whose fingers are nearest to zero (0) or farthest from it (1)."""
        model, q = self.model, self._neutral.copy()
        limits = np.column_stack([model.lowerPositionLimit, model.upperPositionLimit])
        farther = np.argmax(np.abs(limits), axis=1)
        chosen = limits[np.arange(model.nq), farther if end else 1 - farther]
        for name, joint in zip(list(model.names)[1:], model.joints[1:], strict=True):
            mimic, index = self._mimics.get(name), joint.idx_q
            if name in self._moving:
                continue
            if mimic is None:
                q[index] = chosen[index]
            elif mimic.get("joint", "") in model.names:
                leader = model.joints[model.getJointId(mimic.get("joint", ""))].idx_q
                q[index] = float(mimic.get("multiplier", 1)) * chosen[leader] + float(mimic.get("offset", 0))
        return q


def _tips(points: FloatArray, axes: FloatArray) -> FloatArray:
    """Return the middle of the last 2 cm of a finger, (3,)."""
    along = points @ axes[:, 2]
    return points[along > along.max() - 0.02].mean(axis=0)
