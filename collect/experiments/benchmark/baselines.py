"""Who takes part in the benchmark: each controller, what its operator sends, and how often it is asked."""

from dataclasses import replace

import numpy as np

from handrail.collect.experiments.benchmark.catalogue import FILTER_PERIOD
from handrail.collect.experiments.mink.controller import MinkController
from handrail.collect.tasks.goal_reaching import STEP
from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.arm_completion import WeldedBaseCompletion
from handrail.controllers.baselines.base_following import BaseFollowingCompletion
from handrail.controllers.baselines.cbf_filter import CbfFilter
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.baselines.twist_completion import WholeBodyCompletion, twist_controller
from handrail.controllers.baselines.twist_completion import blended as blend
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import Controller, State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.prediction import Bounded, Prediction, Smoothed, after
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.mpc.safety_filter import safety_filter
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.model import RobotModel

TAKE_UP, TAKE_UP_TURN = 1.0, 0.65  # time constants of the masked MPC's hand [s]
_NOW = np.zeros(1)  # no time ahead [s]


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
    time_constant = np.full(channels.size, TAKE_UP)
    time_constant[channels.tool_slice][3:] = TAKE_UP_TURN
    return Smoothed(Bounded(channels), time_constant)


class HandIntent:
    """The operator steers the hand: the twist goes on the tool's channels.

    Args:
        model: of the robot.
    """

    def __init__(self, model: RobotModel) -> None:
        self._channels = Channels.of(model.description)
        self._mask = self._channels.mask("ee")

    def __call__(self, twist: FloatArray, state: State, time: float) -> Intent:
        """Return the intent of a twist, world-aligned at the tool, that was sent at a time [s]."""
        values = np.zeros(self._channels.size)
        values[self._channels.tool_slice] = twist
        return Intent(values, self._mask, mode="hand", time=time)


class SmoothedHandIntent:
    """The operator steers the hand through the masked MPC's own low-pass; for controllers that have none.

    What arrives is what `goal_reaching_prediction` says of this moment. Remembers; one an episode.

    Args:
        model: of the robot.
    """

    def __init__(self, model: RobotModel) -> None:
        self._hand = HandIntent(model)
        self._predict = goal_reaching_prediction(Channels.of(model.description))

    def __call__(self, twist: FloatArray, state: State, time: float) -> Intent:
        """Return the smoothed intent of a twist, world-aligned at the tool, that was sent at a time [s]."""
        intent = self._hand(twist, state, time)
        self._predict = after(self._predict, intent)
        return replace(intent, values=self._predict(intent, _NOW)[0])


class JointIntent:
    """The operator steers every joint, and works out how alone: plain damped least squares.

    What reaches the controller is a complete command, as direct control and safety filters expect it; nobody
    could do that by hand so well.

    Args:
        model: of the robot.
    """

    def __init__(self, model: RobotModel) -> None:
        self._channels = Channels.of(model.description)
        self._mask = self._channels.mask("joint")
        self._resolve = WholeBodyCompletion(model)

    def __call__(self, twist: FloatArray, state: State, time: float) -> Intent:
        """Return the intent of a twist, world-aligned at the tool, that was sent at a time [s]."""
        values = np.zeros(self._channels.size)
        values[self._channels.joint_slice] = self._resolve(state.q, state.v, twist, STEP)
        return Intent(values, self._mask, mode="joints", time=time)


def mpc(model: RobotModel) -> Controller:
    """Return the masked MPC of the benchmark."""
    predict = goal_reaching_prediction(Channels.of(model.description))
    return MaskedMpc(model, goal_reaching_settings(), predict=predict)


def mpc_paper(model: RobotModel) -> Controller:
    """Return the masked MPC with the paper's horizon."""
    return MaskedMpc(model, paper_settings())


def mink(model: RobotModel) -> Controller:
    """Return differential inverse kinematics with collision avoidance."""
    return MinkController(model, STEP)


def whole_body(model: RobotModel) -> Controller:
    """Return damped least squares on all joints."""
    return twist_controller(model, WholeBodyCompletion(model), STEP)


def nominal_base(model: RobotModel) -> Controller:
    """Return damped least squares on the arm, and a nominal base."""
    return twist_controller(model, WeldedBaseCompletion(model), STEP)


def base_following(model: RobotModel) -> Controller:
    """Return base and arm that share nothing but the robot."""
    return twist_controller(model, BaseFollowingCompletion(model), STEP)


def blended(model: RobotModel) -> Controller:
    """Return the average of two completions."""
    both = blend(WholeBodyCompletion(model), WeldedBaseCompletion(model))
    return twist_controller(model, both, STEP)


def direct(model: RobotModel) -> Controller:
    """Return direct joint control."""
    return DirectController(model, STEP)


def cbf(model: RobotModel) -> Controller:
    """Return the CBF safety filter."""
    return CbfFilter(model, STEP)


def multi_step(model: RobotModel) -> Controller:
    """Return the multi-step safety filter."""
    return safety_filter(model, FILTER_PERIOD)
