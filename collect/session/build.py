"""From settings to a session: the robot, the environment, the operator and the controller."""

import importlib.metadata
from collections.abc import Callable, Mapping, Sequence

import gymnasium
import numpy as np

from handrail.collect.config import SessionConfig, check_fps
from handrail.collect.envs.env import RENDER_SIZE, HandrailEnv
from handrail.collect.operators.modes import Completion, TeleopMode, find_mode, minding, without
from handrail.collect.operators.scripts.drawer import DrawerScript
from handrail.collect.operators.scripts.pick_place import PickPlaceScript
from handrail.collect.operators.scripts.reach import ReachScript
from handrail.collect.operators.scripts.scripted import ScriptedOperator
from handrail.collect.operators.scripts.tray import TrayScript
from handrail.collect.session.session import Observer, Session
from handrail.collect.simulation.ideal_robot import IdealRobot
from handrail.collect.simulation.simulation import Simulation
from handrail.collect.tasks.drawer import Drawer
from handrail.collect.tasks.pick_place import PickPlace
from handrail.collect.tasks.reach import Reach
from handrail.collect.tasks.task import Task
from handrail.collect.tasks.tray import Tray
from handrail.controllers.baselines.cbf_filter import CbfFilter
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.baselines.split_controller import split_controller
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import Controller
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.mpc.safety_filter import safety_filter
from handrail.controllers.objectives.limit_centring import narrow_joint_centring
from handrail.controllers.objectives.objective import Objective
from handrail.controllers.objectives.tray import tray_levelling
from handrail.controllers.robot.model import RobotModel
from handrail.datasets.format.schema import Feature
from handrail.datasets.recording.frames import frame_features

ENVIRONMENTS = {
    "drawer": "handrail/Drawer-v0",
    "pick_place": "handrail/PickPlace-v0",
    "reach": "handrail/Reach-v0",
    "tray": "handrail/Tray-v0",
}
TASK_CLASSES: Mapping[str, Callable[..., Task]] = {
    "drawer": Drawer,
    "pick_place": PickPlace,
    "reach": Reach,
    "tray": Tray,
}
SCRIPTS = {"drawer": DrawerScript, "pick_place": PickPlaceScript, "reach": ReachScript, "tray": TrayScript}
CONTROLLERS: Mapping[Completion, Callable[[RobotModel, float], Controller]] = {
    "mpc": lambda model, period: MaskedMpc(model),
    "direct": DirectController,
    "filter": safety_filter,
    "cbf": CbfFilter,
    "split": split_controller,
}
OBJECTIVES: Mapping[str, Callable[[Channels], tuple[Objective, ...]]] = {
    "tray": lambda channels: (tray_levelling(channels, up=np.array([0.0, 0.0, -1.0]), level=LEVEL),)
}
LEFT = {"tray": ("ee.wx", "ee.wy")}  # a tray's tilt is the MPC's, not the operator's
MINDED = {"tray": ("ee.vz",)}  # who drives with a tray in hand minds how high it is
LEVEL = 20.0  # weight of a tray's tilt
CENTRED = 10.0  # weight of the middle of joints that cannot turn half around
_VERSIONED = ("handrail", "lerobot", "mujoco", "pin", "coal", "casadi", "daqp", "numpy", "gymnasium")


def build_env(
    config: SessionConfig, fps: int, render: tuple[int, int] | bool = False, task: Task | None = None
) -> HandrailEnv:
    """Return the environment of a session.

    Args:
        config: of the session.
        fps: recording rate [Hz], and the robot's where the settings do not say another.
        render: whether `env.render()` shall give good-looking pictures; or their height and width [px].
        task: instead of the one that the settings name.

    Raises:
        HandrailError: a setting is wrong, or cameras are asked for and GL is missing.
    """
    config.check()
    check_fps(fps)
    env = gymnasium.make(
        ENVIRONMENTS[config.task],
        task=task or build_task(config),
        robot=config.robot,
        fps=config.robot_fps or fps,
        plant=Simulation if config.physics else IdealRobot,
        cameras=config.camera_names,
        image_size=(config.image_size, config.image_size),
        render_mode="rgb_array" if render else None,
        render_size=render if isinstance(render, tuple) else RENDER_SIZE,
        disable_env_checker=True,
    )
    unwrapped = env.unwrapped
    if not isinstance(unwrapped, HandrailEnv):
        raise HandrailError(f"environment of task {config.task}: expected a HandrailEnv, got {unwrapped}")
    return unwrapped


def build_task(config: SessionConfig) -> Task:
    """Return the task, with the time limit and the moving obstacles of the settings."""
    limit = {"horizon": config.time_limit} if config.time_limit else {}
    moving = {"moving_obstacles": config.moving_obstacles} if config.moving_obstacles else {}
    return TASK_CLASSES[config.task](**limit, **moving)


def build_session(
    config: SessionConfig, env: HandrailEnv, observers: Sequence[Observer] = (), fps: float | None = None
) -> Session:
    """Return the session of an environment, recorded at a rate [Hz]; at the robot's by default."""
    fps = fps or env.fps
    control_fps = config.control_fps or fps
    mode = build_mode(config, env.model)
    mode = leave_to_objectives(mode, config.task)
    operator = build_operator(config, mode, env.model)
    controller = build_controller(mode, env.model, control_fps, config.task)
    return Session(
        env,
        controller,
        operator,
        observers,
        config.realtime,
        control_period=1.0 / control_fps,
        record_period=1.0 / fps,
    )


def build_operator(config: SessionConfig, mode: TeleopMode, model: RobotModel) -> ScriptedOperator:
    """Return the scripted operator of a task in a mode: the person that the settings name."""
    script = SCRIPTS[config.task](model, mode.gains, drives=mode.drives)
    human = config.human.scaled(config.noise).person(np.random.default_rng(config.person))
    return ScriptedOperator(model, script, mode, human)


def build_controller(mode: TeleopMode, model: RobotModel, fps: float, task: str = "") -> Controller:
    """Return the controller of a mode; the masked MPC's knows the objectives that robot and task bring."""
    if mode.controller == "mpc":
        return MaskedMpc(model, objectives=_objectives(model, task))
    return CONTROLLERS[mode.controller](model, 1.0 / fps)


def _objectives(model: RobotModel, task: str) -> tuple[Objective, ...]:
    channels = Channels.of(model.description)
    of_task = OBJECTIVES[task](channels) if task in OBJECTIVES else ()
    return (*of_task, *narrow_joint_centring(channels, model.description.limits, CENTRED))


def leave_to_objectives(mode: TeleopMode, task: str) -> TeleopMode:
    """Return the mode without the channels that a task's objectives look after under the masked MPC.

    And with those that are not to be left to it while only the base is steered.
    """
    if mode.controller != "mpc":
        return mode
    return minding(without(mode, LEFT.get(task, ())), MINDED.get(task, ()))


def build_mode(config: SessionConfig, model: RobotModel) -> TeleopMode:
    """Return the teleop mode, with the mask of the command line if there is one.

    Raises:
        HandrailError: the mask has the wrong size or other characters than 0 and 1.
    """
    mode = find_mode(config.mode)
    if not config.mask:
        return mode
    channels = Channels.of(model.description)
    if set(config.mask) - {"0", "1"} or len(config.mask) != channels.size:
        raise HandrailError(
            f"--mask {config.mask}: expected {channels.size} characters 0 or 1, "
            f"one each for {', '.join(channels.names)}; got {len(config.mask)}"
        )
    names = tuple(np.array(channels.names)[np.array(list(config.mask)) == "1"])
    return TeleopMode(
        config.mode_name, lambda focus: names, mode.controller, "a mask of one's own", gains=mode.gains
    )


def session_features(env: HandrailEnv) -> dict[str, Feature]:
    """Return the dataset's columns of an environment."""
    return frame_features(
        state=env.agent_names,
        environment=env.state_names,
        joints=env.model.joints,
        channels=Channels.of(env.model.description).names,
        cameras=env.cameras,
        image_size=env.image_size,
    )


def software_versions() -> dict[str, str]:
    """Return the versions that a dataset depends on."""
    return {name: importlib.metadata.version(name) for name in _VERSIONED}
