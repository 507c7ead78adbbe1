"""How a simulation looks in an episode: light, colours, textures, cameras. No physics change with it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handrail.collect.world.gl import MjModel, mujoco
from handrail.collect.world.scene import Scene
from handrail.controllers.arrays import FloatArray

_AWAY, _TURN, _ZOOM = 0.02, np.deg2rad(3.0), 0.03  # of a camera [m], [rad], share of its field of view
_WIDEST = 170.0  # field of view [deg]
_CELLS = (2, 4, 8, 16, 32)  # of the floor's pattern along a metre


@dataclass(frozen=True)
class Looks:
    """The colours, lights and cameras of an episode."""

    randomise: bool = False
    """Whether light, colours, textures, and the cameras' poses and fields of view are others."""
    moved: float = 0.0
    """Each camera is 2 cm times this away from its place, and turned by 3° times this."""

    def apply(self, model: MjModel, scene: Scene, rng: np.random.Generator) -> None:
        """Change a compiled model.

        Things that can be moved, and markers, keep their colours but for a little, for these say what is to
        be done with them.

        Args:
            model: to change.
            scene: what stands around the robot.
            rng: drawn from, for each part apart from the other.
        """
        drawn, moved = rng.spawn(2)
        if self.randomise:
            _draw_light(model, drawn)
            _draw_colours(model, {item.name for item in scene.objects if item.movable or item.ghost}, drawn)
            _draw_textures(model, drawn)
            _move_cameras(model, *drawn.normal(0.0, [[[_AWAY]], [[_TURN]]], (2, model.ncam, 3)))
            zoomed = model.cam_fovy * drawn.normal(1.0, _ZOOM, model.ncam)
            model.cam_fovy[:] = np.minimum(zoomed, _WIDEST)
        if self.moved:
            ways = moved.normal(size=(2, model.ncam, 3))
            ways /= np.linalg.norm(ways, axis=2, keepdims=True)
            _move_cameras(model, self.moved * _AWAY * ways[0], self.moved * _TURN * ways[1])


def _draw_light(model: MjModel, rng: np.random.Generator) -> None:
    """Let it be brighter or darker, warmer or colder, and come from elsewhere above."""
    head = model.vis.headlight
    for light in (head.ambient, head.diffuse, *model.light_diffuse):
        light *= rng.uniform(0.6, 1.4) * rng.uniform(0.9, 1.1, 3)
    ways = model.light_dir / np.linalg.norm(model.light_dir, axis=1, keepdims=True)
    ways += rng.normal(0.0, 0.4, ways.shape)
    ways[:, 2] = -np.abs(ways[:, 2]) - 0.1
    model.light_dir[:] = ways / np.linalg.norm(ways, axis=1, keepdims=True)


def _draw_colours(model: MjModel, kept: set[str], rng: np.random.Generator) -> None:
    """Draw a colour for each one of the robot and of each thing; those that say something change a little."""
    drawn: dict[tuple[float, ...], FloatArray] = {}
    for rgba, body, material in zip(model.geom_rgba, model.geom_bodyid, model.geom_matid, strict=True):
        if model.body(body).name in kept:
            rgba[:3] = np.clip(rgba[:3] * rng.uniform(0.85, 1.15) + rng.uniform(-0.05, 0.05, 3), 0.0, 1.0)
        elif material < 0:  # the floor has one
            of_thing = (int(model.body_rootid[body]), *map(float, rgba))
            if of_thing not in drawn:
                drawn[of_thing] = _colour(rng)
            rgba[:3] = drawn[of_thing]


def _colour(rng: np.random.Generator) -> FloatArray:
    """Return a colour that is paler than those which say something, (3,)."""
    return 0.5 * rng.uniform(0.1, 1.0) + 0.5 * rng.uniform(0.0, 1.0, 3)


def _draw_textures(model: MjModel, rng: np.random.Generator) -> None:
    """Give the sky other colours, and the floor another pattern."""
    sky, floor = (_texture(model, name) for name in ("sky", "checker"))
    shade = sky.mean(axis=2, keepdims=True)
    cells = int(rng.choice(_CELLS))
    pattern = np.kron(rng.random((cells, cells)), np.ones(np.array(floor.shape[:2]) // cells))[..., None]
    for pixels, share in ((sky, (shade - shade.min()) / np.ptp(shade)), (floor, pattern)):
        one, other = _colour(rng), _colour(rng)
        pixels[:] = 255.0 * (one + share * (other - one))


def _texture(model: MjModel, name: str) -> NDArray[np.uint8]:
    """Return a texture of the model, to be changed, (height, width, channels)."""
    which = model.texture(name).id
    shape = model.tex_height[which], model.tex_width[which], model.tex_nchannel[which]
    begin = model.tex_adr[which]
    return model.tex_data[begin : begin + np.prod(shape)].reshape(shape)


def _move_cameras(model: MjModel, away: FloatArray, turned: FloatArray) -> None:
    """Put cameras elsewhere [m] and turn them [rad], (cameras, 3) each."""
    model.cam_pos[:] += away
    for quaternion, turn in zip(model.cam_quat, turned, strict=True):
        mujoco.mju_quatIntegrate(quaternion, turn, 1.0)
