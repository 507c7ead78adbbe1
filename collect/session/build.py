"""From settings to a session: the robot, the environment, the operator and the controller."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from handrail.collect.config import SessionConfig, check_fps
from handrail.collect.operators.catalogue import OPERATORS
from handrail.collect.operators.modes import MODES, TeleopMode, mode_of_mask
from handrail.collect.operators.operator import Operator
from handrail.collect.session.disturbances import sample_shifted
from handrail.collect.session.mode_controller import ModeController
from handrail.collect.session.session import Observer, Session
from handrail.collect.world.env import RENDER_SIZE, HandrailEnv
from handrail.collect.world.ideal_robot import IdealRobot
from handrail.collect.world.looks import Looks
from handrail.collect.world.plant import Plant
from handrail.collect.world.simulation import Simulation
from handrail.collect.world.task import Task
from handrail.collect.world.tasks.catalogue import TASKS, check_robot
from handrail.controllers.baselines.catalogue import CONTROLLERS
from handrail.controllers.errors import HandrailError, check_installed, restated
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import Controller
from handrail.controllers.objectives.regularisation import narrow_joint_centring
from handrail.controllers.registry import fitting, importable, resolved
from handrail.controllers.robot.model import RobotModel, load_model
from handrail.datasets.format.schema import Feature
from handrail.datasets.recording.frames import frame_features


def build_env(
    config: SessionConfig,
    fps: int,
    render: tuple[int, int] | bool = False,
    shift: float = 0.0,
    plant: Callable[..., Plant] | None = None,
    moved: float = 0.0,
) -> HandrailEnv:
    """Return the environment of a session.

    Args:
        config: of the session.
        fps: recording rate [Hz], and the robot's where the settings do not say another.
        render: whether `env.render()` shall give good-looking pictures; or their height and width [px].
        shift: how far from the demonstrations' start the robot begins at most [m, rad].
        plant: makes a robot that is no simulation.
        moved: how far the cameras are away from their places, times 2 cm and 3°.
    """
    config.check()
    check_fps(fps)
    task, model = build_task(config), load_model(config.robot)
    check_robot(config.task, model.description)
    return HandrailEnv(
        task,
        model.with_hand(config.hand),
        fps=config.robot_fps or fps,
        plant=plant or (Simulation if config.physics else IdealRobot),
        real=plant is not None,
        cameras=config.camera_names,
        image_size=config.image_shape,
        render_mode="rgb_array" if render else None,
        render_size=render if isinstance(render, tuple) else RENDER_SIZE,
        sample=partial(sample_shifted, task, shift) if shift else None,
        looks=Looks(config.randomise, moved),
    )


def build_task(config: SessionConfig) -> Task:
    """Return the task, with the time limit and the moving obstacles of the settings."""
    settings = {"time_limit": config.time_limit, "moving_obstacles": config.moving_obstacles}
    return resolved(TASKS.find(config.task).task)(**{key: value for key, value in settings.items() if value})


def build_session(
    config: SessionConfig,
    env: HandrailEnv,
    observers: Sequence[Observer] = (),
    fps: float | None = None,
    person: Operator | None = None,
    share: Callable[[Operator], Operator] | None = None,
) -> Session:
    """Return the session of an environment.

    Args:
        config: of the session.
        env: a robot, its world and a task.
        observers: shown every frame.
        fps: recording rate [Hz]; the robot's by default.
        person: who steers now and may change the mode, instead of the operator of the settings.
        share: returns who steers where a policy drives beside them.
    """
    fps = fps or env.fps
    control_fps = config.control_fps or fps
    mode = build_mode(config, env.model)
    operator = person or build_operator(config, mode, env.model)
    model, build = env.model, partial(build_controller, fps=control_fps, task=config.task)
    return Session(
        env,
        ModeController(build_modes(config, env), build, mode, model) if person else build(mode, model),
        share(operator) if share else operator,
        observers,
        realtime=(config.realtime or person is not None) and not env.real,
        control_period=1.0 / control_fps,
        record_period=1.0 / fps,
        undoes=person is not None and not env.real,
    )


def build_operator(config: SessionConfig, mode: TeleopMode, model: RobotModel) -> Operator:
    """Return the operator of a task in a mode; a scripted one is the person that the settings name."""
    human = config.human.scaled(config.noise).person(np.random.default_rng(config.person))
    build = resolved(OPERATORS.find(config.operator).build)
    return build(model, mode, TASKS.find(config.task), human)


def build_controller(mode: TeleopMode, model: RobotModel, fps: float, task: str = "") -> Controller:
    """Return the controller of a mode; the masked MPC's knows the objectives that robot and task bring."""
    spec, build = CONTROLLERS.find(mode.controller), resolved(CONTROLLERS.find(mode.controller).build)
    if not spec.objectives:
        return build(model, 1.0 / fps)
    channels = Channels.of(model.description)
    make = TASKS.find(task).objectives if task and mode.task_objectives else None
    of_task = resolved(make)(channels, model.number) if make else ()
    return build(model, 1.0 / fps, (*of_task, *narrow_joint_centring(channels, model.description.limits)))


def build_mode(config: SessionConfig, model: RobotModel) -> TeleopMode:
    """Return the teleop mode, without what the task's objectives look after under the masked MPC.

    With the mask of the command line if there is one, on velocity sticks.
    """
    mode, task = MODES.find(config.mode), TASKS.find(config.task)
    model.description.check_hands(f"mode {mode.name}", mode.hands)
    if config.mask:
        own = mode_of_mask(config.mask, Channels.of(model.description), mode.controller)
        mode = replace(own, task_objectives=mode.task_objectives)
    if mode.extra:
        check_installed(f"mode {mode.name}", (mode.module,), mode.extra)
    if reason := _reason_against(mode, model):
        raise HandrailError(f"mode {mode.name}: {reason}")
    if not (CONTROLLERS.find(mode.controller).objectives and mode.task_objectives):
        return mode
    return mode.leaving(task.released_channels, task.owned_channels)


def build_modes(config: SessionConfig, env: HandrailEnv) -> dict[str, TeleopMode]:
    """Return the modes that a person can change to, by name: all for the robot, and that of the settings."""
    reason_against = partial(_reason_against, model=env.model)
    fit = importable(fitting(MODES, len(env.model.description.hands)), reason_against)
    rest = (replace(config, mode=name, mask="") for name, each in fit if not reason_against(each))
    return {mode.name: mode for mode in (build_mode(each, env.model) for each in (config, *rest))}


def _reason_against(mode: TeleopMode, model: RobotModel) -> str:
    """Return why a robot cannot be driven in a mode; "" if it can. Imports the mode's controller."""
    robot, channels, hand = model.description, Channels.of(model.description), model.hand.name
    with restated(f"mode {mode.name}"):  # whatever another package's code raises
        if not mode.available:
            return f"expected the package {mode.module}, found none; install it"
        owned = dict.fromkeys((*mode.owned("hand", hand), *mode.owned("base", hand)))
        if missing := ", ".join(group for group in owned if not channels.have(group)):
            return f"expected a robot with channels {missing}, got {robot.name}"
        spec = CONTROLLERS.find(mode.controller)
        resolved(spec.build)
        return "" if spec.fits(robot) else f"its controller cannot drive {robot.name}: {spec.help}"


def session_features(env: HandrailEnv, shared: bool = False) -> dict[str, Feature]:
    """Return the dataset's columns of an environment; `shared` where a policy steers beside the person."""
    return frame_features(
        state=env.agent_names,
        environment=env.state_names,
        joints=env.model.joints,
        channels=Channels.of(env.model.description).names,
        cameras=env.cameras,
        image_size=env.image_size,
        grippers=[hand.named("gripper") for hand in env.model.description.hands],
        shared=shared,
    )
