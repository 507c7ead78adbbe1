"""One episode's physics: a robot in a scene, driven by velocities."""

import math
from copy import copy
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handrail.collect.world.contacts import Contacts
from handrail.collect.world.gl import MjSpec, mujoco
from handrail.collect.world.gripper import FingersServo, fingers
from handrail.collect.world.looks import Looks
from handrail.collect.world.plant import Gate, Plant
from handrail.collect.world.robot import BASE_BODY, build_robot, grasp_geoms
from handrail.collect.world.scene import Scene
from handrail.collect.world.stage import add_scene
from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.errors import HandrailError, restated
from handrail.controllers.interface.controller import State
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Obstacle

_TIMESTEP = 0.002  # [s]
_UNSTABLE = slice(int(mujoco.mjtWarning.mjWARN_BADQPOS), int(mujoco.mjtWarning.mjWARN_BADQACC) + 1)


class Simulation(Plant):
    """A plant: a fresh MuJoCo model and data; nothing of an earlier episode can remain in it.

    Args:
        model: of the robot.
        scene: what stands around it.
        q: where it begins, (n,).
        step: of the control [s].
        meshes: whether to draw the robot as it looks.
        grip: widths of what the hands' grippers are closed around at the beginning [m]; None of one that is
            open, as are those that nothing is said of.
        grips: whether grippers can move; else they stay open.
        timestep: longest step of the integrator [s].
        gate: what every command passes; by default one that sends a dataset's numbers.

    Attributes:
        mujoco_model: the compiled model.
        data: its state.
    """

    def __init__(
        self,
        model: RobotModel,
        scene: Scene,
        q: FloatArray,
        step: float,
        meshes: bool = False,
        grip: tuple[float | None, ...] = (),
        grips: bool = True,
        timestep: float = _TIMESTEP,
        gate: Gate | None = None,
    ) -> None:
        hands = model.description.hands
        held = (*grip, *[None] * len(hands))[: len(hands)]
        if any(width is not None for width in held) and not grips:
            raise HandrailError(f"grip of a simulation: expected none without grips, got {grip}")
        super().__init__(model, scene)
        self._step = step
        self._gate = gate or Gate(model, step, tuple(float(width is not None) for width in held))
        substeps = math.ceil(step / timestep - 1e-9)
        self._shares = np.arange(1, substeps + 1) / substeps
        trouble = f"robot {model.description.name} in its scene: MuJoCo says"
        with restated(trouble, ValueError):
            spec = _robot(model, meshes, grips, step / substeps).copy()
            add_scene(spec, scene)
            self.mujoco_model = spec.compile()
        self.data = mujoco.MjData(self.mujoco_model)
        self._held_at = -math.inf  # what was held then is known
        self._servos = [FingersServo.of(self.mujoco_model, hand) if grips else None for hand in hands]
        pads = [fingers(hand) if servo else () for hand, servo in zip(hands, self._servos, strict=True)]
        self._contacts = Contacts(self.mujoco_model, scene, grasp_geoms(model), pads)
        self._find()
        self.data.qpos[self._q_index] = q
        for servo, width in zip(self._servos, held, strict=True):
            if servo:
                servo.begin(self.data, width)
        mujoco.mj_forward(self.mujoco_model, self.data)
        self._standing = {item.name: self._pose(item.name) for item in scene.objects}
        self._moving = [item.name for item in scene.objects if item.movable or item.patrol]

    def _find(self) -> None:
        """Find where the robot and what moves by itself are in MuJoCo's arrays."""
        compiled, names = self.mujoco_model, self._model.joints
        self._q_index = _span([compiled.joint(name).qposadr[0] for name in names])
        self._v_index = _span([compiled.joint(name).dofadr[0] for name in names])
        self._servo_index = np.array([compiled.actuator(name).id for name in names])
        self._tools = [compiled.site(hand.named("tool")).id for hand in self._model.description.hands]
        moving = ((item.name, item.patrol) for item in self._scene.objects if item.patrol)
        self._patrols = [(int(compiled.body(name).mocapid[0]), patrol) for name, patrol in moving]
        self._bodies = {item.name: int(compiled.body(item.name).id) for item in self._scene.objects}
        self._speeds = {item.name: self.data.joint(item.name).qvel for item in self._scene.movables}

    def dress(self, looks: Looks, rng: np.random.Generator) -> None:
        """Draw how it looks, before its first picture; it has to have meshes."""
        looks.apply(self.mujoco_model, self._scene, rng)
        mujoco.mj_camlight(self.mujoco_model, self.data)

    def show(self, q: FloatArray) -> None:
        """Put the robot at q, (n,), at rest, for a picture; no time passes."""
        self.data.qpos[self._q_index] = q
        self.data.qvel[:] = 0.0
        self._held_at = -math.inf
        self._see()

    def camera(self, name: str) -> tuple[Pose, float]:
        """Return where a camera is, its axes right, up and back, and its vertical field of view [deg]."""
        index = self.mujoco_model.camera(name).id
        pose = _pose(self.data.cam_xpos[index], self.data.cam_xmat[index])
        return pose, float(self.mujoco_model.cam_fovy[index])

    def _see(self) -> None:
        """Let bodies, cameras and lights be where the joints are."""
        mujoco.mj_kinematics(self.mujoco_model, self.data)
        mujoco.mj_camlight(self.mujoco_model, self.data)

    def send(self, command: ArrayLike) -> NDArray[np.floating]:
        """Reach velocities linearly over one step, grippers at their own speed; return what was sent.

        Args:
            command: velocities at the end of the step [m/s, rad/s] and grippers, (n + h,).
        """
        contacts, model, data = self._contacts, self.mujoco_model, self.data
        contacts.clear()
        before = self._gate.velocity
        sent = self._gate.limit(command, data.qpos[self._q_index])
        ctrl, shares = data.ctrl, self._shares[:, None]
        ramp = np.empty((len(shares), len(ctrl)))
        ramp[:, self._servo_index] = (1.0 - shares) * before + shares * self._gate.velocity
        for servo, closed in zip(self._servos, sent[-len(self._servos) :].tolist(), strict=True):
            if servo:
                now, reach = ctrl[servo.actuator], servo.gripper.pace * self._step * self._shares
                way = servo.target(closed) - now
                ramp[:, servo.actuator] = now + np.minimum(np.maximum(way, -reach), reach)
        for ctrl[:] in ramp:
            if self._patrols:
                self._move_obstacles()
            mujoco.mj_step(model, data)
            if data.ncon:
                contacts.look(data)
        self._move_obstacles()
        self._see()
        return sent

    def checkpoint(self) -> object:
        """Return the whole state, to come back to."""
        return copy(self.data), self._gate.state(), self._contacts.pairs

    def restore(self, checkpoint: Any) -> None:
        """Come back to a state: from there all goes on as it did."""
        data, sent, pairs = checkpoint
        mujoco.mj_copyData(self.data, self.mujoco_model, data)
        self._gate.restore(sent)
        self._contacts.pairs = pairs
        self._held_at = -math.inf

    @property
    def contacts(self) -> tuple[str, ...]:
        """The forbidden contacts of the last step."""
        return self._contacts.names

    def push(self, base: FloatArray, hand: FloatArray) -> None:
        """Let forces act from now on, until others are set.

        Args:
            base: on the base's centre of mass, in the world, (3,) [N].
            hand: at the tool point of the hand that does the task, in the world, (3,) [N].
        """
        data = self.data
        data.xfrc_applied[:] = 0.0
        data.xfrc_applied[self.mujoco_model.body(BASE_BODY).id, :3] = base
        tool = self._tools[self._model.number]
        carrier = self.mujoco_model.site_bodyid[tool]
        lever = data.site_xpos[tool] - data.xipos[carrier]
        data.xfrc_applied[carrier] += np.concatenate([hand, np.cross(lever, hand)])

    def _move_obstacles(self) -> None:
        """Put what moves by itself where it is now."""
        for body, patrol in self._patrols:
            self.data.mocap_pos[body] = patrol.position(self.data.time)

    def state(self) -> State:
        """Return the measured positions and velocities, and what was commanded last."""
        data = self.data
        return State(data.qpos[self._q_index], data.qvel[self._v_index], data.time, self._gate.velocity)

    @property
    def time(self) -> float:
        """Since the episode began [s]."""
        return self.data.time

    @property
    def tools(self) -> tuple[Pose, ...]:
        """The poses of the tool points."""
        return tuple(_pose(self.data.site_xpos[tool], self.data.site_xmat[tool]) for tool in self._tools)

    @property
    def openings(self) -> tuple[float, ...]:
        """How far grippers are open, from 0 to 1; 0 of a hand without one."""
        hands = zip(self._model.description.hands, self._servos, strict=True)
        return tuple(
            servo.opening(self.data) if servo else float(hand.gripper is not None) for hand, servo in hands
        )

    @property
    def is_stable(self) -> bool:
        """Whether MuJoCo never had to give up on a step."""
        return not self.data.warning.number[_UNSTABLE].any()

    def poses(self) -> dict[str, Pose]:
        """Return where every scene object is now, by name."""
        return self._standing | {name: self._pose(name) for name in self._moving}

    def still(self) -> frozenset[str]:
        """Return the names of the movable objects that are at rest: slower than 2 cm/s and 0.2 rad/s."""
        speeds = ((name, v[:3], v[3:]) for name, v in self._speeds.items())  # w is ω, none of what slides
        return frozenset(name for name, v, w in speeds if v.dot(v) < 0.02**2 and w.dot(w) < 0.2**2)

    def held(self) -> tuple[Obstacle, ...]:
        """Return what the fingers hold, fixed to the tool as it is now."""
        if self._held_at != self.data.time:
            found, hands, tools = self._contacts.held(self.data), self._model.description.hands, self.tools
            self._held = tuple(
                self._scene.find(name).carried(tools[hand], self._pose(name), hands[hand].named("tool"))
                for name, hand in found.items()
            )
            self._held_at = self.data.time
        return self._held

    def _pose(self, name: str) -> Pose:
        body = self._bodies[name]
        return _pose(self.data.xpos[body], self.data.xmat[body])


def _pose(position: FloatArray, rotation: FloatArray) -> Pose:
    """Return a copy of where something is in MuJoCo's arrays, (3,) and (9,)."""
    return Pose(position.copy(), rotation.reshape(3, 3).copy())


def _span(places: list[int]) -> slice | IntArray:
    """Return places that follow each other as a slice, for which numpy needs no copy."""
    index = np.array(places)
    together = np.array_equal(index, np.arange(index[0], index[0] + len(index)))
    return slice(int(index[0]), int(index[-1]) + 1) if together else index


@lru_cache(maxsize=8)
def _robot(model: RobotModel, meshes: bool, grips: bool, timestep: float) -> MjSpec:
    spec = build_robot(model, meshes, grips)
    spec.compiler.usethread = meshes  # without any, waking a second thread takes longer than its work
    spec.option.timestep = timestep
    return spec
