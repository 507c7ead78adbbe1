"""The masked MPC in a loop of your own: you steer the hand, the base and the arm follow, and keep clear.

python docs/examples/mpc_loop.py
"""

import numpy as np

from handrail.controllers import Intent, MaskedMpc, Obstacle, Shape, State, load_model

PERIOD = 0.05  # between two updates [s]


def main() -> None:
    """Move the hand 1.5 m ahead, past a pillar in the base's way."""
    model = load_model("ridgeback_ur10")
    mpc = MaskedMpc(model)
    pillar = Obstacle("pillar", Shape("cylinder", np.array([0.15, 0.4])), np.array([-0.3, 0.3, 0.2]))
    mpc.reset((pillar,))

    mask = mpc.channels.mask("ee")  # you own the six channels of the hand, the controller owns the rest
    values = np.zeros(mpc.channels.size)
    values[mpc.channels.names.index("ee.vx")] = 0.2  # [m/s], along the world's x axis

    q, v = model.description.home, np.zeros(model.size)
    start, aside = model.pose(q).position, 0.0
    for step in range(150):
        time = step * PERIOD
        command = mpc.update(State(q, v, time, commanded=v), Intent(values, mask, time=time))
        following = command.velocity(PERIOD)
        q, v = q + PERIOD * (v + following) / 2, following  # an ideal robot; yours goes here
        aside = min(aside, q[1])
        if step % 30 == 29:
            hand = model.pose(q).position - start
            print(
                f"{time + PERIOD:.1f} s: hand moved {hand.round(2)} m, base {q[:2].round(2)} m,"
                f" status {command.diagnostics.status}"
            )
    print(f"The base went {-aside:.2f} m aside to pass the pillar; the hand went straight on.")


if __name__ == "__main__":
    main()
