"""A sketch of the whole update in C, measured on the controller's own problems; the C is in `core/`.

The structures and the shapes of their arrays are read from core.h, so that they are said once. coal measures
shapes whose cores meet, and CasADi the residuals, both called back.
"""

import ctypes
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.ocp.problem import Problem
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle, Shape
from handrail.controllers.solvers.active_set import NOTHING_ACTIVE

_FOLDER = Path(__file__).parent / "core"
_FLAGS = ("-O3", "-std=c11", "-fPIC", "-shared", "-ffp-contract=off")
_FIELD = re.compile(r"  (int64_t|double) (\*?)(\w+);(?:\s*/\* \(([^)]*)\))?")
_FUNCTION = re.compile(r"  (int|void) \(\*(\w+)\)")
_NUMBERS = ctypes.POINTER(ctypes.c_double)
_CALL = {
    "void": ctypes.PYFUNCTYPE(None),
    "int": ctypes.PYFUNCTYPE(ctypes.c_int, ctypes.c_int64, _NUMBERS, _NUMBERS),
}
_KINDS = ("sphere", "capsule", "box", "cylinder", "floor")
_NUMBER = {"int64_t": (ctypes.c_int64, np.int64), "double": (ctypes.c_double, np.float64)}
_WORK = 3e7


def compiler() -> str | None:
    """Return the C compiler's path; None where there is none."""
    return shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


@cache
def library() -> ctypes.PyDLL:
    """Return the core, compiled now."""
    with tempfile.TemporaryDirectory() as folder:
        built = Path(folder) / "core.so"
        sources = map(str, sorted(_FOLDER.glob("*.c")))
        subprocess.run([str(compiler()), *_FLAGS, *sources, "-o", str(built), "-lm"], check=True)
        return ctypes.PyDLL(str(built))


class Memory:
    """A structure of core.h and its arrays, which are attributes.

    Args:
        name: of the structure.
        sizes: the letters of core.h.
    """

    def __init__(self, name: str, **sizes: int) -> None:
        body = re.search(rf"typedef struct {{\n((?:(?!typedef).)*?)\n}} {name};", _header(), re.DOTALL)
        fields: list[tuple[str, Any]] = []
        arrays: dict[str, FloatArray] = {}
        for line in body[1].splitlines() if body else ():
            if function := _FUNCTION.match(line):
                fields.append((function[2], _CALL[function[1]]))
            elif field := _FIELD.match(line):
                kind, pointer, label, shape = field.groups()
                single, many = _NUMBER[kind]
                fields.append((label, ctypes.c_void_p if pointer else single))
                if pointer:
                    arrays[label] = np.zeros(_shape(shape, sizes), many)
        self.fields = type(name, (ctypes.Structure,), {"_fields_": fields})()
        for label, size in sizes.items():
            setattr(self.fields, label, size)
        for label, array in arrays.items():
            setattr(self, label, array)
            setattr(self.fields, label, array.ctypes.data)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.fields, name)


@cache
def _header() -> str:
    return (_FOLDER / "core.h").read_text()


def _shape(text: str, sizes: dict[str, int]) -> tuple[int, ...]:
    parts = [part for part in text.split(",") if part.strip()]
    return tuple(int(eval(part, {}, dict(sizes))) for part in parts)


class CoreScene:
    """The pairs of a collision model.

    Args:
        model: of the robot.
        collision: its pairs.
        obstacles: around it.
        nodes: of the longest path.
    """

    def __init__(
        self, model: RobotModel, collision: CollisionModel, obstacles: Sequence[Obstacle], nodes: int
    ) -> None:
        shapes = collision._shapes
        things = list(shapes.geometry.geometryObjects)
        self.memory = memory = Memory("Scene", n=model.size, S=len(things), P=collision.size, K=nodes)
        _take_joints(memory, model.pinocchio)
        known = {thing.name: thing.shape for thing in (*model.description.collision, *obstacles)}
        for index, thing in enumerate(things):
            memory.carrier[index] = thing.parentJoint
            memory.shape_rotation[index] = thing.placement.rotation.ravel()
            memory.shape_position[index] = thing.placement.translation
            shape = known.get(thing.name)
            memory.kind[index] = _KINDS.index(shape.kind if shape else "floor")
            memory.size[index] = _size(shape) if shape else 0.0
        pairs = shapes.geometry.collisionPairs
        memory.first[:], memory.second[:] = [p.first for p in pairs], [p.second for p in pairs]
        memory.moves[:] = shapes.moves[:, 1] - shapes.moves[:, 0]
        memory.bounds[:] = shapes.motion_bounds
        self._geometry = [thing.geometry for thing in things]
        memory.fields.measure = _CALL["int"](self._measure)

    def distances(self, q: FloatArray) -> FloatArray:
        """Return the signed distances at a configuration, (n,), (P,) [m]."""
        found, everything = np.empty(self.memory.P), np.full(self.memory.P, np.inf)
        arguments = (np.array(q), np.zeros(1), None, None, everything, found)
        given = [None if array is None else ctypes.c_void_p(array.ctypes.data) for array in arguments]
        library().scene_values(ctypes.byref(self.memory.fields), ctypes.c_int64(1), *given)
        return found

    def _measure(self, pair: int, placements: Any, witness: Any) -> int:
        given = np.ctypeslib.as_array(placements, (2, 12))
        first, second = self._geometry[self.memory.first[pair]], self._geometry[self.memory.second[pair]]
        poses = [coal.Transform3s(each[:9].reshape(3, 3).copy(), each[9:].copy()) for each in given]
        result = coal.DistanceResult()
        coal.distance(first, poses[0], second, poses[1], coal.DistanceRequest(), result)
        points = result.getNearestPoint1(), result.getNearestPoint2()
        np.ctypeslib.as_array(witness, (9,))[:] = np.concatenate([result.normal, *points])
        return 0


def _take_joints(memory: Memory, model: pin.Model) -> None:
    data = model.createData()
    columns = pin.computeJointJacobians(model, data, pin.neutral(model))
    for number in range(1, model.njoints):
        index, placement = number - 1, model.jointPlacements[number]
        turns = bool(columns[3:, index].any())
        memory.parent[index], memory.slides[index] = model.parents[number], not turns
        memory.joint_rotation[index] = placement.rotation.ravel()
        memory.joint_position[index] = placement.translation
        axis = columns[3:, index] if turns else columns[:3, index]
        memory.joint_axis[index] = data.oMi[number].rotation.T @ axis


def _size(shape: Shape) -> FloatArray:
    """Return a shape's size as shapes.h has it, (3,)."""
    if shape.kind == "box":
        return 0.5 * shape.size
    radius, *length = shape.size
    return np.array([radius, 0.5 * length[0] if length else 0.0, 0.0])


class CoreSolver:
    """Solves the problems of one controller in the core.

    Attributes:
        active: numbers of the rows that were active at last.
    """

    def __init__(self, mpc: MaskedMpc) -> None:
        self._mpc = mpc
        self._scene: tuple[CollisionModel, CoreScene, Memory] | None = None
        self.active: IntArray = NOTHING_ACTIVE

    def solve(
        self, problem: Problem, obstacles: Sequence[Obstacle], guess: FloatArray
    ) -> tuple[float, Memory]:
        """Return how long the core took [s], and its memory, with the plan in it.

        Args:
            problem: of an update.
            obstacles: that stand around.
            guess: accelerations, (N, n).
        """
        if self._scene is None or self._scene[0] is not problem.collision:
            nodes = problem.horizon + 3
            scene = CoreScene(self._mpc.model, problem.collision, obstacles, nodes)
            self._scene = problem.collision, scene, self._memory(problem)
            self.active = NOTHING_ACTIVE
        _, scene, memory = self._scene
        start = perf_counter()
        for name in ("q", "v", "margins", "reference"):
            getattr(memory, name)[:] = getattr(problem, name)
        memory.weights[:], memory.guess[:] = problem.weights, guess
        weights, band = (ctypes.c_void_p(array.ctypes.data) for array in (memory.weights, memory.constant))
        core = ctypes.byref(memory.fields)
        library().constant_hessian(core, weights, band)
        memory.active[: len(self.active)] = self.active
        memory.fields.active_rows, memory.fields.work = len(self.active), _WORK
        self._mpc.residuals._p[:] = problem.parameters
        library().core_solve(core, ctypes.byref(scene.memory.fields))
        self.active = memory.active[: memory.active_rows].copy()
        return perf_counter() - start, memory

    def _memory(self, problem: Problem) -> Memory:
        residuals, limits = self._mpc.residuals, problem.limits
        affine = residuals.affine
        row, column = np.nonzero(affine.jacobian)
        count, n = problem.horizon, self._mpc.model.size
        sizes = {"N": count, "n": n, "K": count + 3, "M": count * n, "V": count * n + 4, "B": 3 * n}
        rows = {"R": len(residuals.reference), "A": len(affine.index), "C": len(residuals.curved)}
        memory = Memory("Core", **sizes, **rows, E=len(row), P=problem.collision.size)
        memory.begins[:] = np.searchsorted(row, np.arange(len(affine.index) + 1))
        memory.columns[:], memory.entries[:] = column, affine.jacobian[row, column]
        memory.offset[:], memory.affine[:], memory.curved[:] = affine.offset, affine.index, residuals.curved
        memory.lower[:], memory.upper[:] = limits.position_lower, limits.position_upper
        memory.v_max[:], memory.a_max[:] = limits.velocity, limits.acceleration
        memory.pair_slack[:] = problem.collision.kinds
        fields = memory.fields
        fields.dt, fields.activation = problem.dt, problem.activation_distance
        fields.linear, fields.quadratic = problem.slack_linear, problem.slack_quadratic
        for name in ("z", "values", "jacobians"):  # CasADi writes into arrays of its own
            setattr(fields, name, getattr(residuals, f"_{name}").ctypes.data)
        fields.evaluate = _CALL["void"](residuals._evaluate_all)
        fields.evaluate_values = _CALL["void"](residuals._evaluate_values)
        return memory
