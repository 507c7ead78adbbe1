"""The data that a browser draws an episode from: shapes once, and where each body is, many times a second."""

import hashlib
from typing import Any

import numpy as np

from handrail.collect.world.geometry import VISIBLE_GROUP
from handrail.collect.world.gl import MjData, MjModel, mujoco
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.parts import EndEffector

_KINDS = ("box", "capsule", "sphere", "cylinder", "ellipsoid", "mesh")  # that the page draws
_DIGITS = 4  # of a pose: a tenth of a millimetre


def shapes(model: MjModel) -> dict[str, Any]:
    """Return the visible geoms of a model (body, place, shape, colour, mesh), and where each mesh begins."""
    geoms = []
    for index in np.flatnonzero(model.geom_group == VISIBLE_GROUP).tolist():
        kind = mujoco.mjtGeom(model.geom_type[index]).name.removeprefix("mjGEOM_").lower()
        if kind in _KINDS:
            geom = {
                "body": int(model.geom_bodyid[index]),
                "at": _rounded(np.concatenate([model.geom_pos[index], model.geom_quat[index]])),
                "kind": kind,
                "size": _rounded(model.geom_size[index]),
                "rgba": _rounded(model.geom_rgba[index]),
                "mesh": int(model.geom_dataid[index]),
            }
            geoms.append(geom)
    names = [model.body(index).name for index in range(model.nbody)]
    rows = [model.mesh_vertadr, model.mesh_vertnum, model.mesh_faceadr, model.mesh_facenum]
    table = {"rows": np.stack(rows, axis=1).tolist(), "vertices": len(model.mesh_vert)}
    return {"bodies": names, "geoms": geoms, "meshes": table}


def hand(model: MjModel, which: EndEffector) -> list[int]:
    """Return the bodies that are a hand: the gripper, or the link behind it, and what hangs on that."""
    names = {model.body(index).name: index for index in range(model.nbody)}
    tool = int(model.site_bodyid[model.site(which.named("tool")).id])
    drawn = set(model.geom_bodyid[model.geom_group == VISIBLE_GROUP].tolist())
    first = names.get(which.named("gripper"), tool)
    first = first if first in drawn else tool
    within = [first]
    for index in range(first + 1, model.nbody):  # a body comes after the one that it hangs on
        if int(model.body_parentid[index]) in within:
            within.append(index)
    return within


def meshes(model: MjModel) -> tuple[str, bytes]:
    """Return all meshes of a model as bytes, and their digest: vertices (float32), then faces (uint32)."""
    data = model.mesh_vert.astype("<f4").tobytes() + model.mesh_face.astype("<u4").tobytes()
    return hashlib.sha256(data).hexdigest()[:16], data


def poses(data: MjData) -> list[float]:
    """Return where every body is: position [m] and quaternion (wxyz), one after the other."""
    return _rounded(np.hstack([data.xpos, data.xquat]).ravel())


def _rounded(values: FloatArray) -> list[float]:
    return np.round(values, _DIGITS).tolist()
