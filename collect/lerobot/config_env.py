"""Settings of the environment `handrail` of `lerobot-eval` and `lerobot-train`."""

from dataclasses import dataclass, field
from typing import Annotated, Any

from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_IMAGES, OBS_STATE
from msgspec import Meta

from handrail.collect.config import SessionConfig
from handrail.collect.lerobot.configs import SimulatedConfig
from handrail.collect.lerobot.mode_action import ModeAction
from handrail.collect.operators.modes import MASK, MODES
from handrail.collect.seeds import FIRST_SEED
from handrail.collect.session.build import build_mode, build_task
from handrail.collect.world.observation import AgentObservation
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.model import load_model
from handrail.controllers.typed import check


@EnvConfig.register_subclass("handrail")
@dataclass
class HandrailEnvConfig(SimulatedConfig, EnvConfig):
    """A task of Handrail. Policies read and write in it the numbers that `handrail-record` records.

    With a mode and `scene_in_state` it is what `lerobot-record` records (`--robot.diagnostics=false`).
    """

    mode: str = ""
    """Empty: actions are joint velocities. A teleop mode, or `mask:` with 0 and 1: they are its channels."""
    scene_in_state: bool = False
    """Whether robot and scene are one vector, `observation.state`."""
    render_size: int = 128
    """Height and width of the films that LeRobot makes of the first episodes [px]."""
    time_limit: float = 0.0
    """Time after which an episode has failed [s]; the task's own when 0."""
    first_seed: int = FIRST_SEED
    """Added to LeRobot's `--seed`: by default the episodes are `handrail-evaluate`'s, none of a recording."""
    features_map: dict[str, str] = field(
        default_factory=lambda: {ACTION: ACTION, "agent_pos": OBS_STATE, "environment_state": OBS_ENV_STATE}
    )

    def __post_init__(self) -> None:
        """Say what a policy reads and writes."""
        config, model = self.session(), load_model(self.robot).with_hand(self.hand)
        mode = build_mode(config, model) if self.mode else MODES["direct"]
        actions = len(ModeAction(mode, Channels.of(model.description), model.hand.name).names)
        robot, scene = len(AgentObservation(model).names), len(build_task(config).state_names)
        self.features = {
            ACTION: PolicyFeature(FeatureType.ACTION, (actions,)),
            "agent_pos": PolicyFeature(FeatureType.STATE, (robot + scene * self.scene_in_state,)),
        }
        if not self.scene_in_state:
            self.features["environment_state"] = PolicyFeature(FeatureType.ENV, (scene,))
        picture = PolicyFeature(FeatureType.VISUAL, (*config.image_shape, 3))
        for camera in config.camera_names:
            self.features[f"pixels/{camera}"] = picture
            self.features_map.setdefault(f"pixels/{camera}", f"{OBS_IMAGES}.{camera}")

    def session(self) -> SessionConfig:
        """Return the settings of the session behind it."""
        if not self.task:
            raise HandrailError("--env.task: expected a task, got none")
        check(self.render_size, Annotated[int, Meta(ge=16, multiple_of=2)], "--env.render_size")
        masked = self.mode.startswith(MASK)
        mode = SessionConfig.mode if masked or not self.mode else self.mode
        mask = self.mode.removeprefix(MASK) if masked else ""
        return self._session(mode=mode, mask=mask, time_limit=self.time_limit)

    @property
    def gym_id(self) -> str:
        """The environment, one for every task; `handrail.collect` has registered it."""
        return "handrail/LeRobot-v0"

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        """Arguments of the environment."""
        return {
            "config": self.session(),
            "fps": self.fps,
            "mode": bool(self.mode),
            "scene_in_state": self.scene_in_state,
            "render_size": (self.render_size, self.render_size),
            "first_seed": self.first_seed,
        }
