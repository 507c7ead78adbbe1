"""A controller of your own: a rule from the hand's twist to the whole body's velocity.

It looks at nothing but this moment: see how it misses goals and touches itself, where the MPC does not.

python docs/examples/new_controller.py
"""

import gymnasium

import handrail.collect  # noqa: F401  (registers the environments)
from handrail.collect import MODES, Session, SessionConfig
from handrail.collect.session.build import build_operator
from handrail.controllers import RobotModel
from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.twist_completion import TwistController


class TransposedJacobian:
    """Every joint moves by how much it helps: `v = Jᵀ x k`, with k so that the hand is as fast as asked.

    Args:
        model: of the robot.
    """

    def __init__(self, model: RobotModel) -> None:
        self._model = model

    def __call__(self, q: FloatArray, previous: FloatArray, twist: FloatArray, period: float) -> FloatArray:
        """Return the velocity wanted, (n,) [m/s, rad/s], for the twist of the hand, (6,)."""
        J = self._model.jacobian(q)  # (6, n)
        v = J.T @ twist
        made = J @ v
        return v * float(made @ twist) / max(float(made @ made), 1e-9)


def main() -> None:
    """Let the scripted operator steer through it; input checks, limits and brakes come with the shell."""
    env = gymnasium.make("handrail/Reach-v0").unwrapped
    controller = TwistController(env.model, TransposedJacobian(env.model), period=1.0 / env.fps)
    operator = build_operator(SessionConfig(task="reach"), MODES["ee"], env.model)
    session = Session(env, controller, operator)
    for seed in range(3):
        outcome = session.run(seed)
        result = "reached" if outcome.success else outcome.failure_reason
        print(
            f"seed {seed}: {result} after {outcome.seconds:.1f} s, {outcome.contact_onsets} contacts,"
            f" smallest distance {outcome.smallest_distance:.2f} m"
        )
    env.close()


if __name__ == "__main__":
    main()
