"""A task of your own, from outside of Handrail: touch a ball with the hand's tip, and how to run it.

python docs/examples/new_task.py
"""

from dataclasses import dataclass

import numpy as np

from handrail.collect.config import SessionConfig
from handrail.collect.envs.env import HandrailEnv
from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_controller, build_operator
from handrail.collect.session.session import Session
from handrail.collect.simulation.scene import Scene, SceneObject
from handrail.collect.tasks.task import Episode, TaskState, Verdict
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Shape


@dataclass(frozen=True)
class TouchBall:
    """Bring the tip of the hand within 3 cm of a ball that hangs in front of the robot."""

    name: str = "TouchBall"
    description: str = "Touch the ball."
    horizon: float = 20.0  # [s]
    state_names: tuple[str, ...] = ("ball.x", "ball.y", "ball.z")

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Episode:
        """Hang the ball somewhere in front of the robot; nothing else is there."""
        home = model.pose(model.description.home)
        place = home.position + rng.uniform((0.3, -0.6, -0.2), (1.0, 0.6, 0.2))
        ball = SceneObject("ball", Shape("sphere", np.array([0.03])), place, ghost=True)
        return Episode(Scene((ball,)), model.description.home, Pose(place, home.rotation))

    def features(self, state: TaskState) -> FloatArray:
        """Return what is recorded as `observation.environment_state`: where the ball is, (3,) [m]."""
        return state.pose("ball").position

    def outcome(self, state: TaskState) -> Verdict:
        """Say whether it is done."""
        return Verdict(bool(np.linalg.norm(state.tool.position - state.pose("ball").position) < 0.03))


def main() -> None:
    """Let the scripted operator of `reach` do it: it goes to any goal that an episode names."""
    env, mode = HandrailEnv(TouchBall()), MODES["ee"]
    operator = build_operator(SessionConfig(task="reach"), mode, env.model)
    session = Session(env, build_controller(mode, env.model, env.fps), operator)
    for seed in range(3):
        outcome = session.run(seed)
        print(f"seed {seed}: {'touched' if outcome.success else 'missed'} after {outcome.seconds:.1f} s")


if __name__ == "__main__":
    main()
