"""Settings of the robot and the teleoperators, as LeRobot's commands take them, with our own names."""

from dataclasses import dataclass
from typing import Annotated, Any

from lerobot.robots import RobotConfig
from lerobot.teleoperators import TeleoperatorConfig
from msgspec import Meta

from handrail.collect.cockpit_config import CockpitConfig
from handrail.collect.config import SessionConfig, check_fps
from handrail.collect.teleop_config import TeleopConfig
from handrail.controllers.typed import Count, NonNegative, check


@dataclass(kw_only=True)
class SimulatedConfig:
    """The simulated session; the names are those of `handrail-record`."""

    task: str = "reach"
    """The task."""
    robot: str = SessionConfig.robot
    """A robot, or a description file (.toml)."""
    hand: str = ""
    """Which hand does the task, of a robot with several: its name; the first by default."""
    camera_names: str = ""
    """Cameras of the robot, or scene, with commas; none by default."""
    image_size: int | str = SessionConfig.image_size
    """Size of the pictures [px]: of a square's side, or WIDTHxHEIGHT."""
    moving_obstacles: int = 0
    """Obstacles that cross the robot's way; task reach only."""
    fps: int = 20
    """Actions a second [Hz]; say the same to LeRobot (`--dataset.fps`, `--fps`)."""

    def _session(self, **more: Any) -> SessionConfig:
        """Return the settings of the session, checked."""
        check_fps(self.fps, "fps")
        config = SessionConfig(
            task=self.task,
            robot=self.robot,
            hand=self.hand,
            cameras=self.camera_names,
            image_size=self.image_size,
            moving_obstacles=self.moving_obstacles,
            **more,
        )
        config.check()
        return config


@RobotConfig.register_subclass("handrail_sim")
@dataclass(kw_only=True)
class HandrailSimConfig(SimulatedConfig, RobotConfig):
    """A simulated robot with a task, steered through a controller; named as in `handrail-record`."""

    mode: str = SessionConfig.mode
    """Teleop mode: which channels the action has, and what completes them."""
    mask: str = ""
    """A mask of your own instead of the mode's: 0 or 1 for each channel."""
    seed: int = 0
    """Seed of the scenes: those of `handrail-record` with this seed."""
    evaluation: bool = False
    """Whether they are those of `handrail-evaluate` with this seed: none is in a recording."""
    episode: int = 0
    """Number of the first scene; to replay an episode, the number of its scene."""
    realtime: bool = True
    """Never be faster than real time, however often LeRobot asks."""
    diagnostics: bool = True
    """Whether observations say what was sent, and how the controller fared."""

    def session(self) -> SessionConfig:
        """Return the settings of the session behind it."""
        check(self.episode, Count, "--robot.episode")
        return self._session(mode=self.mode, mask=self.mask, seed=self.seed)


@TeleoperatorConfig.register_subclass("handrail_scripted")
@dataclass(kw_only=True)
class HandrailScriptedConfig(TeleoperatorConfig):
    """A script with a human-like hand steers `handrail_sim`."""

    noise: float = SessionConfig.noise
    """How human the hand is: 0 perfect, 1 the default, partly from studies of people."""
    person: int = SessionConfig.person
    """Which person it is; persons differ in delay, noise and all the rest."""
    episode_time_s: float = 0.0
    """The same as `--dataset.episode_time_s`; 0 to begin anew whenever the task is done."""
    reset_time_s: float = 1.0
    """The same as `--dataset.reset_time_s`; the scene changes then."""

    def checked(self) -> "HandrailScriptedConfig":
        """Return these settings, checked."""
        check(self.episode_time_s, NonNegative, "--teleop.episode_time_s")
        check(self.reset_time_s, Annotated[float, Meta(ge=0.5, le=1e12)], "--teleop.reset_time_s")
        return self


@TeleoperatorConfig.register_subclass("handrail_cockpit")
@dataclass(kw_only=True)
class HandrailCockpitConfig(TeleoperatorConfig):
    """A person at a browser steers `handrail_sim`; named as `--cockpit` of `handrail-record`."""

    host: str = CockpitConfig.host
    """Address to listen at; any other than 127.0.0.1 asks for a token, by HTTPS."""
    token: bool = CockpitConfig.token
    """Whether to ask for the token on 127.0.0.1 too; without, every account here can drive."""
    port: int = CockpitConfig.port
    """Port to listen at; the next free one where it is taken; 0 for any."""
    open: bool = CockpitConfig.open
    """Whether to open the page in this computer's browser, unless it asks for a token."""
    certificate: str = ""
    """Folder of a certificate of your own, cert.pem and key.pem."""

    def checked(self) -> CockpitConfig:
        """Return where the cockpit listens, checked."""
        config = CockpitConfig(self.host, self.token, self.port, self.open, self.certificate)
        config.check()
        return config


@TeleoperatorConfig.register_subclass("handrail_gamepad")
@dataclass(kw_only=True)
class HandrailGamepadConfig(TeleoperatorConfig):
    """A person with a gamepad steers `handrail_sim`; named as `--teleop` of `handrail-record`."""

    map: str = ""
    """File (.toml) that gives controls another meaning."""
    dead_zone: float = TeleopConfig.dead_zone
    """Deflection of a stick that counts as none, 0 to 0.5."""
    exponent: float = TeleopConfig.exponent
    """Curve of a stick, 1 (straight) to 3 (fine near the middle)."""

    def checked(self) -> TeleopConfig:
        """Return the settings of the device, checked."""
        config = TeleopConfig(map=self.map, dead_zone=self.dead_zone, exponent=self.exponent)
        config.check("gamepad")
        return config
