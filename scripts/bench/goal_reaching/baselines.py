"""The benchmark's controllers: each one, its operator's messages, and how often it is asked."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from handrail.collect.world.tasks.goal_reaching import STEP
from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.arm_completion import BaseFollowingCompletion, WeldedBaseCompletion
from handrail.controllers.baselines.twist_completion import TwistController, WholeBodyCompletion
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import Controller, State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.prediction import Bounded, Prediction, Smoothed, after
from handrail.controllers.mpc.blended import BlendedMpc
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.model import RobotModel
from handrail.scripts.bench.goal_reaching.config import TAKE_UP

_NOW = np.zeros(1)  # no time ahead [s]

Asks = Callable[[FloatArray, State, float], Intent]
"""Twist, world-aligned at the tool (6,), state, time at which it was sent [s] → intent."""


def goal_reaching_settings() -> MpcSettings:
    """Return the masked MPC's settings in the benchmark; what differs from its defaults, and why.

    Eight stages of 0.5 s look 4 s ahead: the palm keeps clear of the forearm by turning early instead of late
    and fast, which nearly halves the effort where that pair matters. Tracking is no more than a hundred times
    as dear as the motion that it takes, so that the hand yields a little where a command asks much of the
    arm, above all in turns; a planner that sees the hand makes up for it. The base's weight shares the motion
    between base and arm; that of accelerations spreads a turn over the stages. No posture to return to and no
    terminal cost: the protocol has none, and both only add motion. Chosen on goals of seeds from 100 on.
    """
    return MpcSettings(
        dt=0.5,
        horizon=8,
        tracking=10.0,
        turn_tracking=4.0,
        base_velocity=0.022,
        acceleration=0.1,
        posture=0.0,
        terminal_velocity=0.0,
    )


def paper_settings() -> MpcSettings:
    """Return the paper's own horizon and weights: ten stages of 0.1 s, all of them tracked alike.

    N = 10, dt = 0.1 s, γ = 1, no posture to return to, no terminal cost; the weights are those of its code.
    Margins, the penalty of slack and the check that a stop remains are ours, as in `goal_reaching_settings`.
    It is asked every 0.09 s: the simulation has steps of 0.03 s, and after a stage the certified stop begins.
    """
    return MpcSettings(
        horizon=10,
        dt=0.1,
        decay=1.0,
        tracking=1000.0,
        turn_tracking=1000.0,
        base_velocity=0.01,
        arm_velocity=0.1,
        acceleration=0.01,
        posture=0.0,
        terminal_velocity=0.0,
    )


def goal_reaching_prediction(channels: Channels) -> Prediction:
    """Return the masked MPC's intent prediction in the benchmark.

    A command is taken up in about a second, which spares the arm the steps of an open-loop planner and of
    its keys; the hand goes on for as long after the command has ended. Turns are taken up earlier.

    Args:
        channels: of the robot.
    """
    time_constant = np.full(channels.size, TAKE_UP[0])
    time_constant[channels.hand_slice()][3:] = TAKE_UP[1]
    return Smoothed(Bounded(channels), time_constant)


def _asks(
    model: RobotModel, group: str, values_of: Callable[[FloatArray, State], FloatArray], mode: str
) -> Asks:
    """Return an operator who owns a group's channels and sends values made of twist and state on them."""
    channels = Channels.of(model.description)
    mask = channels.mask(group)

    def ask(twist: FloatArray, state: State, time: float) -> Intent:
        values = np.zeros(channels.size)
        values[mask] = values_of(twist, state)
        return Intent(values, mask, mode=mode, time=time)

    return ask


def hand_intent(model: RobotModel) -> Asks:
    """Return an operator who steers the hand: the twist goes on the tool's channels."""
    return _asks(model, "ee", lambda twist, state: twist, "hand")


def smoothed_hand_intent(model: RobotModel) -> Asks:
    """Return one who steers the hand through the masked MPC's own low-pass; for controllers that have none.

    What arrives is what `goal_reaching_prediction` says of this moment. Remembers; one an episode.
    """
    hand, predict = hand_intent(model), goal_reaching_prediction(Channels.of(model.description))

    def ask(twist: FloatArray, state: State, time: float) -> Intent:
        nonlocal predict
        intent = hand(twist, state, time)
        predict = after(predict, intent)
        return replace(intent, values=predict(intent, _NOW)[0])

    return ask


def joint_intent(model: RobotModel) -> Asks:
    """Return one who steers every joint, and works out how alone: plain damped least squares.

    What reaches the controller is a complete command, as direct control and safety filters expect it; nobody
    could do that by hand so well.
    """
    resolve = WholeBodyCompletion(model)
    return _asks(model, "joint", lambda twist, state: resolve(state.q, state.v, twist, STEP), "joints")


def mpc(model: RobotModel, period: float) -> Controller:
    """Return the masked MPC of the benchmark."""
    predict = goal_reaching_prediction(Channels.of(model.description))
    return MaskedMpc(model, goal_reaching_settings(), predict=predict)


def mpc_paper(model: RobotModel, period: float) -> Controller:
    """Return the masked MPC with the paper's horizon."""
    return MaskedMpc(model, paper_settings())


def mpc_one_stage(model: RobotModel, period: float) -> Controller:
    """Return the masked MPC with the paper's weights and a horizon of one stage: it predicts nothing."""
    return MaskedMpc(model, replace(paper_settings(), horizon=1))


def nominal_base(model: RobotModel, period: float) -> Controller:
    """Return damped least squares on the arm, and a nominal base."""
    return TwistController(model, WeldedBaseCompletion(model), period)


def base_following(model: RobotModel, period: float) -> Controller:
    """Return base and arm that share nothing but the robot."""
    return TwistController(model, BaseFollowingCompletion(model), period)


def blended(model: RobotModel, period: float) -> Controller:
    """Return `mpc_paper` with an actor that knows the goal and helps where both agree: mode `blended`."""
    return BlendedMpc(model, paper_settings())
