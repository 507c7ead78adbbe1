"""LeRobot's own recording loop, with the masked MPC between a teleoperator of LeRobot's and a LeKiwi.

The hand goes where the gamepad says, in three numbers; the base and the rest of the arm come along.

python docs/examples/record_with_mpc.py 127.0.0.1 outputs/lekiwi gamepad
"""

import sys

from lerobot.datasets import LeRobotDataset
from lerobot.processor import make_default_processors
from lerobot.robots.lekiwi import LeKiwiClient, LeKiwiClientConfig
from lerobot.scripts.lerobot_record import record_loop
from lerobot.utils.feature_utils import hw_to_dataset_features

from handrail.collect.devices.leader_arm import make_teleoperator
from handrail.collect.processor.mpc_step import MaskedMpcStep, mpc_pipeline
from handrail.collect.teleop_config import LeaderConfig

FPS, SECONDS, EPISODES = 30, 20.0, 2
INPUTS = {"delta_x": ["ee.vx", 0.1], "delta_y": ["ee.vy", 0.1], "delta_z": ["ee.vz", 0.1]}


def main(address: str, folder: str, device: str, ports: tuple[int, int], seconds: float) -> None:
    """Record; a robot that has `cameras` is served by `lerobot_record.record(config, …)` as well."""
    step = MaskedMpcStep("lekiwi", "lekiwi", FPS, INPUTS, gripper="actions")  # 0 close, 1 stay, 2 open
    _, as_it_is, observed = make_default_processors()
    robot = LeKiwiClient(LeKiwiClientConfig(address, *ports, cameras={}))
    features = hw_to_dataset_features(robot.action_features, "action")
    features |= hw_to_dataset_features(robot.observation_features, "observation")
    dataset = LeRobotDataset.create("me/lekiwi", FPS, features, folder, robot.name)
    teleoperator = make_teleoperator(LeaderConfig(device))
    teleoperator.connect()
    robot.connect()
    events = {"exit_early": False, "rerecord_episode": False, "stop_recording": False}
    for _ in range(EPISODES):
        processors = mpc_pipeline(step), as_it_is, observed
        record_loop(robot, events, FPS, *processors, dataset, teleoperator, seconds, "Reach.")  # pyright: ignore
        dataset.save_episode()
    dataset.finalize()
    robot.disconnect()
    print(
        f"{dataset.num_episodes} episodes, {dataset.num_frames} frames; brakes: {dict(step.counts) or 'none'}"
    )


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    first, last = map(int, sys.argv[4:6] or (5555, 5556))
    main(*sys.argv[1:4], (first, last), float((sys.argv[6:] or [SECONDS])[0]))
