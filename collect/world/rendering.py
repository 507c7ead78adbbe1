"""Pictures of a simulation: a fast setting for observations, a pretty one for people."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from handrail.collect.world.geometry import VISIBLE_GROUP
from handrail.collect.world.gl import MjData, MjModel, missing_graphics, mujoco
from handrail.controllers.errors import check_known

_MORE_GEOMS = 300  # than the model has: what films draw beside it
_LASTING = (
    *("mesh_vert", "mesh_normal", "mesh_face", "mesh_vertadr", "mesh_faceadr"),
    *("tex_data", "tex_adr", "mat_texid", "mat_texrepeat", "mat_texuniform"),
)
_BULGING = [getattr(mujoco.mjtGeom, f"mjGEOM_{kind}").value for kind in ("SPHERE", "CAPSULE", "ELLIPSOID")]


class Painter:
    """Draws simulations, offscreen, episode after episode.

    The OpenGL context stays from one to the next: what it compiles takes as long as a hundred pictures.

    Args:
        size: height and width of the pictures [px].
        pretty: with shadows and smooth edges, which takes longer.
    """

    _context: Any = None  # of OpenGL
    _loaded: Any = None  # meshes and textures of one model in it
    _drawn: tuple[bytes, ...] = ()  # what they were made of

    def __init__(self, size: tuple[int, int], pretty: bool = False) -> None:
        self._size, self._pretty = size, pretty
        self._area = mujoco.MjrRect(0, 0, size[1], size[0])
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = 0
        self._option.geomgroup[VISIBLE_GROUP] = 1
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._model: MjModel = None

    def paint(self, model: MjModel, data: MjData, camera: str) -> NDArray[np.uint8]:
        """Return what a camera sees, (height, width, 3).

        Args:
            model: of the simulation; its visual settings become those of the pictures.
            data: its state.
            camera: name of the camera.
        """
        cameras = [model.camera(index).name for index in range(model.ncam)]
        check_known("camera", (camera,), cameras)
        if model is not self._model:
            self._load(model)
        self._camera.fixedcamid = cameras.index(camera)
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(model, data, self._option, None, self._camera, everything, self._scene)
        picture = np.empty((*self._size, 3), np.uint8)
        self._context.make_current()
        mujoco.mjr_render(self._area, self._scene, self._loaded)
        mujoco.mjr_readPixels(picture, None, self._area, self._loaded)
        return np.flipud(picture).copy()  # OpenGL begins at the bottom

    def _load(self, model: MjModel) -> None:
        """Take the meshes and textures of a model; where they are those of the last one they stay."""
        visual = model.vis
        visual.global_.offheight, visual.global_.offwidth = self._size
        visual.quality.shadowsize, visual.quality.offsamples = (4096, 8) if self._pretty else (0, 0)
        if not self._pretty and not bulges(model):
            visual.quality.numstacks = 2  # a cylinder's bands look the same
        drawn = _drawn(model)
        if self._loaded is None or drawn != self._drawn:
            self._upload(model)
            self._drawn = drawn
        self._scene = mujoco.MjvScene(model, model.ngeom + _MORE_GEOMS)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = self._pretty
        self._model = model

    def _upload(self, model: MjModel) -> None:
        """Bring meshes and textures to where they are drawn from, in place of those of the last one."""
        self._unload()
        try:
            self._context = self._context or mujoco.GLContext(self._size[1], self._size[0])
            self._context.make_current()
            self._loaded = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50.value)
        except Exception as error:  # each backend has its own kind
            raise missing_graphics(error) from error
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._loaded)

    def _unload(self) -> None:
        loaded, self._loaded, self._model = self._loaded, None, None
        if loaded is not None:
            with self._context.as_current():
                loaded.free()

    def close(self) -> None:
        """Give the OpenGL context back; the next picture makes another."""
        self._unload()
        context, self._context = self._context, None
        if context is not None:
            context.free()

    def __del__(self) -> None:
        self.close()


def _drawn(model: MjModel) -> tuple[bytes, ...]:
    """Return all of a model from which OpenGL makes something that outlasts a picture."""
    arrays = [getattr(model, name) for name in _LASTING]
    planes = model.geom_size[model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE.value]
    return (*(each.tobytes() for each in (*arrays, planes)), bytes([model.vis.quality.numstacks]))


def bulges(model: MjModel) -> bool:
    """Whether something that is drawn is round in two directions."""
    return bool(np.isin(model.geom_type[model.geom_group == VISIBLE_GROUP], _BULGING).any())
