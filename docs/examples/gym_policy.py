"""A Gymnasium environment with a policy of yours: it says what the hand shall do, the MPC does the rest.

python docs/examples/gym_policy.py
"""

import gymnasium
import numpy as np
from scipy.spatial.transform import Rotation

import handrail.collect  # noqa: F401  (registers the environments)
from handrail.controllers import Intent, MaskedMpc
from handrail.controllers.arrays import FloatArray


def policy(observation: dict[str, FloatArray]) -> FloatArray:
    """Return the hand's twist (v, ω): straight to the goal, and no faster than a careful person, (6,)."""
    tool, goal = observation["agent_pos"][-7:], observation["environment_state"][:7]  # position, wxyz
    away = goal[:3] - tool[:3]
    wanted, now = (Rotation.from_quat(each[3:], scalar_first=True) for each in (goal, tool))
    turn = (wanted * now.inv()).as_rotvec()
    return np.concatenate([shortened(1.5 * away, 0.3), shortened(1.5 * turn, 0.6)])


def shortened(vector: FloatArray, most: float) -> FloatArray:
    """Return a vector no longer than `most`."""
    return vector * min(1.0, most / max(np.linalg.norm(vector), 1e-9))


def main() -> None:
    """Run three episodes of `reach`."""
    env = gymnasium.make("handrail/Reach-v0").unwrapped
    mpc = MaskedMpc(env.model)
    mask, values = mpc.channels.mask("ee"), np.zeros(mpc.channels.size)
    for seed in range(3):
        observation, info = env.reset(seed=seed)
        mpc.reset(env.obstacles())
        over = False
        while not over:
            state = env.state()
            values[mpc.channels.hand_slice()] = policy(observation)
            command = mpc.update(state, Intent(values, mask, time=state.time))
            action = np.append(command.velocity(1.0 / env.fps), command.grippers)
            observation, _, terminated, truncated, info = env.step(action)
            over = terminated or truncated
        result = "reached" if info["is_success"] else info["failure_reason"]
        print(f"seed {seed}: {result} after {info['time']:.1f} s")
    env.close()


if __name__ == "__main__":
    main()
