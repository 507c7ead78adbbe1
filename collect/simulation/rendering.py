"""Pictures of a simulation: a fast setting for observations, a pretty one for people."""

import numpy as np
from numpy.typing import NDArray

from handrail.collect.simulation.geometry import VISIBLE_GROUP
from handrail.collect.simulation.gl import MjData, MjModel, missing_graphics, mujoco
from handrail.controllers.errors import unknown_name

CAMERAS = ("wrist", "scene")


class Painter:
    """Draws one simulation, offscreen.

    Args:
        model: of the simulation; its visual settings become those of the pictures.
        size: height and width of the pictures [px].
        pretty: with shadows and smooth edges, which takes longer.

    Raises:
        HandrailError: there is no OpenGL on this machine.
    """

    def __init__(self, model: MjModel, size: tuple[int, int], pretty: bool = False) -> None:
        self._cameras = [model.camera(index).name for index in range(model.ncam)]
        self._pretty = pretty
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = 0
        self._option.geomgroup[VISIBLE_GROUP] = 1
        visual = model.vis
        visual.global_.offheight, visual.global_.offwidth = size
        visual.quality.shadowsize, visual.quality.offsamples = (4096, 8) if pretty else (0, 0)
        try:
            self._renderer = mujoco.Renderer(model, *size, max_geom=300)
        except Exception as error:  # each backend has its own kind
            raise missing_graphics(error) from error

    def paint(self, data: MjData, camera: str) -> NDArray[np.uint8]:
        """Return what a camera sees, (height, width, 3).

        Raises:
            HandrailError: there is no such camera.
        """
        if camera not in self._cameras:
            raise unknown_name("camera", camera, self._cameras)
        self._renderer.update_scene(data, camera, self._option)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._renderer.scene.flags[flag] = self._pretty
        return self._renderer.render()

    def close(self) -> None:
        """Give the OpenGL context back."""
        self._renderer.close()
