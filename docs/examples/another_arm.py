"""The masked MPC for an arm of your own: an SO-101 on a table draws a square, and keeps from a box.

You say where the hand goes, in three numbers. The five joints follow in LeRobot's names and degrees.

python docs/examples/another_arm.py
"""

from pathlib import Path

import numpy as np

from handrail.collect.processor.mpc_step import MaskedMpcStep, mpc_pipeline
from handrail.controllers import load_model

ROBOT = str(Path(__file__).with_name("so101.toml"))
BOX = {"name": "box", "kind": "box", "size": [0.04, 0.04, 0.16], "position": [0.24, -0.11, 0.08]}
SIDES = ("ee.vy", 0.04), ("ee.vz", 0.03), ("ee.vy", -0.04), ("ee.vz", -0.03), ("ee.vy", -0.04)
FPS, SECONDS = 30, 2.0


class SimulatedArm:
    """Answers as a LeRobot robot does: `get_observation`, `send_action`. Yours goes here."""

    def __init__(self) -> None:
        self.joints = dict(zip(load_model(ROBOT).joints, load_model(ROBOT).description.home, strict=True))
        self.gripper = 0.0

    def get_observation(self) -> dict[str, float]:
        """Return where the joints are [degrees], and the gripper [percent]."""
        degrees = {f"{name}.pos": float(np.degrees(q)) for name, q in self.joints.items()}
        return degrees | {"gripper.pos": self.gripper}

    def send_action(self, action: dict[str, float]) -> None:
        """Go there at once."""
        self.joints = {name: np.radians(action[f"{name}.pos"]) for name in self.joints}
        self.gripper = action["gripper.pos"]


def main() -> None:
    """Draw the square; the last side leads towards the box."""
    model, arm, time = load_model(ROBOT), SimulatedArm(), iter(range(10**6))
    step = MaskedMpcStep(ROBOT, "so_follower", FPS, obstacles=[BOX], clock=lambda: next(time) / FPS)
    pipeline = mpc_pipeline(step)  # with a robot of yours leave the clock out, and wait 1/30 s in each round
    start, nearest = model.pose(np.array(list(arm.joints.values()))).position, np.inf
    for channel, speed in SIDES:
        action = {"ee.vx": 0.0, "ee.vy": 0.0, "ee.vz": 0.0} | {channel: speed}
        for _ in range(round(SECONDS * FPS)):
            arm.send_action(pipeline((action, arm.get_observation())))
            nearest = min(nearest, step.diagnostics.smallest_distance if step.diagnostics else np.inf)
        hand = model.pose(np.array(list(arm.joints.values()))).position - start
        print(f"{channel} {speed:+.2f} m/s for {SECONDS:.0f} s: hand at {hand.round(3)} m")
    print(f"nearest to anything: {nearest:.3f} m; brakes: {dict(step.counts) or 'none'}")


if __name__ == "__main__":
    main()
