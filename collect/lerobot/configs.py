"""Settings of the robot and the teleoperators, as LeRobot's commands take them."""

from dataclasses import dataclass

from lerobot.robots import RobotConfig
from lerobot.teleoperators import TeleoperatorConfig

from handrail.collect.cockpit_config import CockpitConfig
from handrail.collect.config import SessionConfig, check_fps
from handrail.collect.teleop_config import TeleopConfig
from handrail.controllers.errors import HandrailError


@RobotConfig.register_subclass("handrail_sim")
@dataclass(kw_only=True)
class HandrailSimConfig(RobotConfig):
    """A simulated robot with a task, steered through a controller. The names are those of `handrail-record`.

    Attributes:
        task: what to do.
        mode: teleop mode: which channels the action has, and what completes them.
        mask: a mask of your own instead of the mode's: 0 or 1 for each channel.
        robot: a robot, or a description file (.toml).
        camera_names: cameras: wrist, scene or both, with a comma; none by default.
        image_size: height and width of the pictures [px].
        moving_obstacles: obstacles that cross the robot's way; task reach only.
        seed: of the scenes: those of `handrail-record` with this seed.
        evaluation: whether they are those of `handrail-evaluate` with this seed: none is in a recording.
        episode: number of the first scene; to replay an episode, the number of its scene.
        fps: actions a second [Hz]; say the same to LeRobot (`--dataset.fps`, `--fps`).
        realtime: never be faster than real time, however often LeRobot asks.
        diagnostics: whether observations say what was sent, and how the controller fared.
    """

    task: str = "reach"
    mode: str = "ee"
    mask: str = ""
    robot: str = "ridgeback_ur10"
    camera_names: str = ""
    image_size: int = 128
    moving_obstacles: int = 0
    seed: int = 0
    evaluation: bool = False
    episode: int = 0
    fps: int = 20
    realtime: bool = True
    diagnostics: bool = True

    def session(self) -> SessionConfig:
        """Return the settings of the session behind it."""
        check_fps(self.fps)
        if self.episode < 0:
            raise HandrailError(f"--robot.episode {self.episode}: expected 0 or more")
        config = SessionConfig(
            task=self.task,
            mode=self.mode,
            mask=self.mask,
            robot=self.robot,
            cameras=self.camera_names,
            image_size=self.image_size,
            moving_obstacles=self.moving_obstacles,
            seed=self.seed,
        )
        config.check()
        return config


@TeleoperatorConfig.register_subclass("handrail_scripted")
@dataclass(kw_only=True)
class HandrailScriptedConfig(TeleoperatorConfig):
    """A script with a human-like hand steers `handrail_sim`.

    Attributes:
        noise: how human the hand is: 0 perfect, 1 the default, partly from studies of people.
        person: which person it is; persons differ in delay, noise and all the rest.
        episode_time_s: the same as `--dataset.episode_time_s`; 0 to begin anew whenever the task is done.
        reset_time_s: the same as `--dataset.reset_time_s`.
    """

    noise: float = 1.0
    person: int = 0
    episode_time_s: float = 0.0
    reset_time_s: float = 1.0

    def check(self) -> None:
        """Check the settings."""
        if not 0.0 <= self.episode_time_s < float("inf"):
            raise HandrailError(f"--teleop.episode_time_s {self.episode_time_s}: expected 0 s or more")
        if not 0.5 <= self.reset_time_s < float("inf"):
            raise HandrailError(
                f"--teleop.reset_time_s {self.reset_time_s}: expected 0.5 s or more: the scene changes then"
            )


@TeleoperatorConfig.register_subclass("handrail_cockpit")
@dataclass(kw_only=True)
class HandrailCockpitConfig(TeleoperatorConfig):
    """A person at a browser steers `handrail_sim`. The names are those of `--cockpit` of `handrail-record`.

    Attributes:
        host: address to listen at; any other than 127.0.0.1 asks for a token, by HTTPS.
        token: whether to ask for the token on 127.0.0.1 too; without, every account here can drive.
        port: to listen at; the next free one where it is taken; 0 for any.
        open: whether to open the page in this computer's browser, unless it asks for a token.
        certificate: folder of a certificate of your own, cert.pem and key.pem.
    """

    host: str = CockpitConfig.host
    token: bool = False
    port: int = CockpitConfig.port
    open: bool = True
    certificate: str = ""

    def cockpit(self) -> CockpitConfig:
        """Return where the cockpit listens."""
        config = CockpitConfig(self.host, self.token, self.port, self.open, self.certificate)
        config.check()
        return config


@TeleoperatorConfig.register_subclass("handrail_gamepad")
@dataclass(kw_only=True)
class HandrailGamepadConfig(TeleoperatorConfig):
    """A person with a gamepad steers `handrail_sim`. The names are those of `--teleop` of `handrail-record`.

    Attributes:
        map: file (.toml) that gives controls another meaning.
        dead_zone: deflection of a stick that counts as none, 0 to 0.5.
        exponent: curve of a stick, 1 (straight) to 3 (fine near the middle).
    """

    map: str = ""
    dead_zone: float = TeleopConfig.dead_zone
    exponent: float = TeleopConfig.exponent

    def teleop(self) -> TeleopConfig:
        """Return the settings of the device."""
        config = TeleopConfig(map=self.map, dead_zone=self.dead_zone, exponent=self.exponent)
        config.check("gamepad")
        return config
