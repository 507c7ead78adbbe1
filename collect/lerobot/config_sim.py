"""Settings of the robot `handrail_sim`, as LeRobot's commands take them."""

from dataclasses import dataclass

from lerobot.robots import RobotConfig

from handrail.collect.config import SessionConfig, check_fps
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
