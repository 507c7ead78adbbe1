"""What every scene stands on and is lit by: floor, sky, lights, solver options."""

from handrail.collect.world import geometry
from handrail.collect.world.gl import MjsGeom, MjSpec, mujoco


def set_stage(spec: MjSpec, timestep: float, looks: bool) -> None:
    """Add floor, sky and lights, and set how the simulation integrates.

    Args:
        spec: the spec to add to.
        timestep: of the integrator [s].
        looks: whether it will be looked at; sky, lights and the floor's pattern take time in every step.
    """
    spec.option.timestep = timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 20.0
    spec.stat.extent = 3.0
    spec.stat.center = [0.0, 0.0, 0.5]
    floor = _add_floor(spec)
    if looks:
        _set_quality(spec)
        _add_sky(spec)
        _add_pattern(spec, floor)
        _add_lights(spec)


def _set_quality(spec: MjSpec) -> None:
    visual = spec.visual
    visual.headlight.ambient = [0.35, 0.35, 0.37]
    visual.headlight.diffuse = [0.25, 0.25, 0.25]
    visual.headlight.specular = [0.05, 0.05, 0.05]
    visual.map.znear = 0.005
    visual.map.zfar = 20.0
    visual.map.shadowclip = 1.6
    visual.rgba.haze = [0.82, 0.87, 0.92, 1.0]


def _add_sky(spec: MjSpec) -> None:
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.86, 0.91, 0.96],
        rgb2=[0.45, 0.58, 0.72],
        width=64,
        height=64,
    )


def _add_floor(spec: MjSpec) -> MjsGeom:
    return spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[8.0, 8.0, 0.1],
        contype=geometry.FLOOR_BIT,
        conaffinity=0,
        friction=[0.8, 0.01, 0.0001],
        group=geometry.VISIBLE_GROUP,
    )


def _add_pattern(spec: MjSpec, floor: MjsGeom) -> None:
    spec.add_texture(
        name="checker",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        rgb1=[0.78, 0.79, 0.80],
        rgb2=[0.70, 0.71, 0.73],
        markrgb=[0.60, 0.61, 0.63],
        width=128,
        height=128,
    )
    textures = [""] * int(mujoco.mjtTextureRole.mjNTEXROLE)
    textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "checker"
    spec.add_material(name="floor", textures=textures, texrepeat=[1.0, 1.0], texuniform=True, reflectance=0.0)
    floor.material = "floor"


def _add_lights(spec: MjSpec) -> None:
    for name, position, diffuse, shadow in (
        ("sun", (1.6, -2.0, 4.5), 0.55, True),
        ("fill", (-3.0, 3.0, 5.0), 0.20, False),
    ):
        spec.worldbody.add_light(
            name=name,
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            pos=position,
            dir=[-value for value in position],
            diffuse=[diffuse] * 3,
            specular=[0.2 * shadow] * 3,
            castshadow=shadow,
        )
