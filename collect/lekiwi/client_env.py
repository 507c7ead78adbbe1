"""The environment of a robot that is driven through its LeRobot client."""

from handrail.collect.config import RecordConfig
from handrail.collect.envs.env import HandrailEnv
from handrail.collect.lekiwi.client_plant import plant_of
from handrail.collect.lekiwi.link import Link, connect
from handrail.collect.session.build import build_env
from handrail.controllers.robot.model import load_model


def open_client(config: RecordConfig) -> tuple[HandrailEnv, Link]:
    """Return the environment of a recording's robot, and the link to it.

    Raises:
        HandrailError: a setting is wrong, or the robot cannot be reached.
    """
    fps = config.robot_fps or config.dataset.fps
    link = connect(config.robot_client, config.client, config.camera_names, load_model(config.robot), fps)
    try:
        env = build_env(config, config.dataset.fps, plant=plant_of(link, lambda: env.np_random_seed))
    except BaseException:
        link.close()
        raise
    return env, link
