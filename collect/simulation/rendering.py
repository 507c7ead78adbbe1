"""Pictures of a simulation: a fast setting for observations, a pretty one for people."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handrail.collect.simulation.geometry import VISIBLE_GROUP
from handrail.collect.simulation.gl import MjData, MjModel, MjrContext, missing_graphics, mujoco
from handrail.controllers.errors import unknown_name

CAMERAS = ("wrist", "scene")


@dataclass(frozen=True)
class Quality:
    """How a picture is drawn: shadow map size (0: none) and samples a pixel (0: jagged edges)."""

    shadows: int = 0
    samples: int = 0


FAST = Quality()
PRETTY = Quality(shadows=4096, samples=8)


class Painter:
    """Draws simulations of one robot, offscreen.

    The OpenGL context, with the robot's meshes in it, outlives the episodes: each has its own compiled model,
    but all have the same meshes and textures.

    Args:
        model: any model with the robot's meshes.
        size: height and width of the pictures [px].
        quality: how they are drawn.

    Raises:
        HandrailError: there is no OpenGL on this machine.
    """

    def __init__(self, model: MjModel, size: tuple[int, int], quality: Quality = FAST) -> None:
        self._height, self._width = size
        self._quality = quality
        self._scene = mujoco.MjvScene(model, maxgeom=300)
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = 0
        self._option.geomgroup[VISIBLE_GROUP] = 1
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._open(model)

    def _open(self, model: MjModel) -> None:
        try:
            from mujoco.gl_context import GLContext

            self._gl = GLContext(self._width, self._height)
            self._gl.make_current()
            self._context = _context(model, self._height, self._width, self._quality)
        except Exception as error:  # each backend has its own kind
            raise missing_graphics(error) from error
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)

    def paint(self, model: MjModel, data: MjData, camera: str) -> NDArray[np.uint8]:
        """Return what a camera sees, (height, width, 3).

        Raises:
            HandrailError: there is no such camera.
        """
        names = [model.camera(index).name for index in range(model.ncam)]
        if camera not in names:
            raise unknown_name("camera", camera, names)
        self._camera.fixedcamid = names.index(camera)
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(model, data, self._option, None, self._camera, everything, self._scene)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = bool(self._quality.shadows)
        self._gl.make_current()
        picture = np.empty((self._height, self._width, 3), np.uint8)
        area = mujoco.MjrRect(0, 0, self._width, self._height)
        mujoco.mjr_render(area, self._scene, self._context)
        mujoco.mjr_readPixels(picture, None, area, self._context)
        return np.ascontiguousarray(picture[::-1])

    def close(self) -> None:
        """Give the OpenGL context back."""
        self._context.free()
        self._gl.free()


def _context(model: MjModel, height: int, width: int, quality: Quality) -> MjrContext:
    """Return a render context; size and quality are settings of the model while it is made."""
    visual = model.vis
    before = (
        visual.global_.offheight,
        visual.global_.offwidth,
        visual.quality.shadowsize,
        visual.quality.offsamples,
    )
    _set(model, (height, width, quality.shadows, quality.samples))
    try:
        return mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
    finally:
        _set(model, before)


def _set(model: MjModel, values: tuple[int, int, int, int]) -> None:
    visual = model.vis
    visual.global_.offheight, visual.global_.offwidth = values[:2]
    visual.quality.shadowsize, visual.quality.offsamples = values[2:]
