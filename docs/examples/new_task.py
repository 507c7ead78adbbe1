"""A task of your own, from outside of Handrail: one class and one entry.

python docs/examples/new_task.py
PYTHONPATH=docs/examples handrail-record outputs/touch --task new_task:TOUCH_BALL
"""

from dataclasses import dataclass

import numpy as np

from handrail.collect import SessionConfig, build_env, build_session
from handrail.collect.world.scene import Scene, SceneObject
from handrail.collect.world.task import Start, Task, TaskState, Verdict
from handrail.collect.world.tasks.catalogue import TaskSpec
from handrail.controllers import Pose, RobotModel, Shape


@dataclass(frozen=True)
class TouchBall(Task):
    """Bring the tip of the hand within 8 cm of a ball that hangs in front of the robot."""

    description: str = "Touch the ball."
    time_limit: float = 20.0  # [s]

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of what `features` returns."""
        return ("ball.x", "ball.y", "ball.z")

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Hang the ball somewhere in front of the robot; nothing else is there."""
        home = model.pose(model.description.home)
        place = home.position + rng.uniform((0.3, -0.6, -0.2), (1.0, 0.6, 0.2))
        ball = SceneObject("ball", Shape("sphere", np.array([0.03])), place, ghost=True)
        return Start(Scene((ball,)), model.description.home, Pose(place, home.rotation))

    def features(self, state: TaskState) -> np.ndarray:
        """Return what is recorded as `observation.environment_state`: where the ball is, (3,) [m]."""
        return state.pose("ball").position

    def outcome(self, state: TaskState) -> Verdict:
        """Say whether it is done: within 8 cm, for the script rests within 6."""
        return Verdict(bool(np.linalg.norm(state.tool.position - state.pose("ball").position) < 0.08))


SCRIPT = "handrail.collect.operators.scripted.reach:ReachScript"  # goes to the goal that an episode names
TOUCH_BALL = TaskSpec("touch_ball", TouchBall, SCRIPT, "touch a ball with the hand's tip")


def main() -> None:
    """Let the scripted operator do it."""
    config = SessionConfig(task="new_task:TOUCH_BALL")
    session = build_session(config, build_env(config, fps=20))
    for seed in range(3):
        outcome = session.run(seed)
        print(f"seed {seed}: {'touched' if outcome.success else 'missed'} after {outcome.seconds:.1f} s")


if __name__ == "__main__":
    main()
