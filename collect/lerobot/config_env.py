"""Settings of the environment `handrail` of `lerobot-eval` and `lerobot-train`."""

from dataclasses import dataclass, field
from typing import Any

from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_IMAGES, OBS_STATE

from handrail.collect.config import SessionConfig, check_fps
from handrail.collect.lerobot.mode_action import ModeAction
from handrail.collect.operators.modes import MASK
from handrail.collect.seeds import FIRST_SEED
from handrail.collect.session.build import build_mode, build_task
from handrail.collect.world.observation import AgentObservation
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.model import load_model


@EnvConfig.register_subclass("handrail")
@dataclass
class HandrailEnvConfig(EnvConfig):
    """A task of Handrail. What policies read and write in it is what `handrail-record` records.

    With a mode and `scene_in_state` it is what `lerobot-record` records (`--robot.diagnostics=false`).

    Attributes:
        task: what to do.
        robot: a robot, or a description file (.toml).
        fps: actions a second [Hz].
        mode: empty for actions that are joint velocities; a teleop mode, or `mask:` with 0 and 1, for actions
            that are its channels, which its controller completes.
        scene_in_state: whether robot and scene are one vector, `observation.state`.
        camera_names: cameras that a policy sees: wrist, scene or both, with a comma.
        image_size: height and width of their pictures [px].
        render_size: height and width of the films that LeRobot makes of the first episodes [px].
        moving_obstacles: obstacles that cross the robot's way; task reach only.
        time_limit: time after which an episode is given up [s]; the task's own when 0.
        first_seed: is added to LeRobot's `--seed`: by default these are the episodes of `handrail-evaluate`,
            and none of a recording.
    """

    task: str | None = "reach"
    robot: str = "ridgeback_ur10"
    fps: int = 20
    mode: str = ""
    scene_in_state: bool = False
    camera_names: str = ""
    image_size: int = 128
    render_size: int = 128
    moving_obstacles: int = 0
    time_limit: float = 0.0
    first_seed: int = FIRST_SEED
    features_map: dict[str, str] = field(
        default_factory=lambda: {
            ACTION: ACTION,
            "agent_pos": OBS_STATE,
            "environment_state": OBS_ENV_STATE,
            "pixels/wrist": f"{OBS_IMAGES}.wrist",
            "pixels/scene": f"{OBS_IMAGES}.scene",
        }
    )

    def __post_init__(self) -> None:
        """Say what a policy reads and writes."""
        config = self.session()
        model = load_model(self.robot)
        size = self.image_size
        actions = model.size + 1
        if self.mode:
            mode = build_mode(config, model)
            actions = len(ModeAction(mode, Channels.of(model.description)).names)
        robot, scene = len(AgentObservation(model).names), len(build_task(config).state_names)
        if self.scene_in_state:
            seen = {"agent_pos": PolicyFeature(FeatureType.STATE, (robot + scene,))}
        else:
            seen = {
                "agent_pos": PolicyFeature(FeatureType.STATE, (robot,)),
                "environment_state": PolicyFeature(FeatureType.ENV, (scene,)),
            }
        self.features = (
            {ACTION: PolicyFeature(FeatureType.ACTION, (actions,))}
            | seen
            | {
                f"pixels/{camera}": PolicyFeature(FeatureType.VISUAL, (size, size, 3))
                for camera in config.camera_names
            }
        )

    def session(self) -> SessionConfig:
        """Return the settings of the session behind it."""
        check_fps(self.fps)
        if not self.task:
            raise HandrailError("--env.task: expected a task, got none")
        if self.render_size < 16 or self.render_size % 2:
            raise HandrailError(f"--env.render_size {self.render_size}: expected an even number from 16")
        masked = self.mode.startswith(MASK)
        config = SessionConfig(
            task=self.task,
            mode=SessionConfig.mode if masked or not self.mode else self.mode,
            mask=self.mode.removeprefix(MASK) if masked else "",
            robot=self.robot,
            cameras=self.camera_names,
            image_size=self.image_size,
            moving_obstacles=self.moving_obstacles,
            time_limit=self.time_limit,
        )
        config.check()
        return config

    @property
    def package_name(self) -> str:
        """The package that registers the environment."""
        return "handrail.collect"

    @property
    def gym_id(self) -> str:
        """The environment: one for every task."""
        return "handrail/LeRobot-v0"

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        """What makes it."""
        return {
            "config": self.session(),
            "fps": self.fps,
            "mode": bool(self.mode),
            "scene_in_state": self.scene_in_state,
            "render_size": (self.render_size, self.render_size),
            "first_seed": self.first_seed,
        }
