"""Who takes part in the benchmark: each controller, what its operator sends, and how often it is asked."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from handrail.collect.experiments.mink.controller import MinkController
from handrail.collect.tasks.goal_reaching import STEP, Goal
from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.arm_completion import WeldedBaseCompletion
from handrail.controllers.baselines.blended_completion import BlendedCompletion
from handrail.controllers.baselines.cbf_filter import CbfFilter
from handrail.controllers.baselines.decoupled_completion import DecoupledCompletion
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.baselines.twist_completion import twist_controller
from handrail.controllers.baselines.whole_body_completion import WholeBodyCompletion
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import Controller, State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.prediction import Bounded, Prediction, Smoothed, after
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.mpc.safety_filter import safety_filter
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.model import RobotModel

MPC_PERIOD = 0.1  # of the protocol [s]
_FILTER_PERIOD = 0.06  # [s]
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
    """The operator steers every joint, and works out how by himself: plain damped least squares.

    What reaches the controller is a complete command, as direct control and safety filters expect it; nobody
    could do that with his hands so well.

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


IntentMap = Callable[[FloatArray, State, float], Intent]


def _no_aim(controller: Controller, goal: Goal) -> None:
    """Tell a controller nothing of the goal: it sees the operator's commands only."""


@dataclass(frozen=True)
class Baseline:
    """One entry of the benchmark; its functions are a module's own, so that worker processes find them.

    Attributes:
        name: as on the command line.
        title: one line.
        build: the controller for a robot.
        operator: what the planner's twist becomes; made anew for every episode.
        period: between two updates [s].
        aim: tells the controller the goal, if it needs to know it.
    """

    name: str
    title: str
    build: Callable[[RobotModel], Controller]
    operator: Callable[[RobotModel], IntentMap] = HandIntent
    period: float = STEP
    aim: Callable[[Controller, Goal], None] = _no_aim


def _mpc(model: RobotModel) -> Controller:
    predict = goal_reaching_prediction(Channels.of(model.description))
    return MaskedMpc(model, goal_reaching_settings(), predict=predict)


def _mpc_paper(model: RobotModel) -> Controller:
    return MaskedMpc(model, paper_settings())


def _mink(model: RobotModel) -> Controller:
    return MinkController(model, STEP)


def _whole_body(model: RobotModel) -> Controller:
    return twist_controller(model, WholeBodyCompletion(model), STEP)


def _nominal_base(model: RobotModel) -> Controller:
    return twist_controller(model, WeldedBaseCompletion(model), STEP)


def _decoupled(model: RobotModel) -> Controller:
    return twist_controller(model, DecoupledCompletion(model), STEP)


def _blended(model: RobotModel) -> Controller:
    blend = BlendedCompletion(WholeBodyCompletion(model), WeldedBaseCompletion(model))
    return twist_controller(model, blend, STEP)


def _direct(model: RobotModel) -> Controller:
    return DirectController(model, STEP)


def _cbf(model: RobotModel) -> Controller:
    return CbfFilter(model, STEP)


def _filter(model: RobotModel) -> Controller:
    return safety_filter(model, _FILTER_PERIOD)


BASELINES: Mapping[str, Baseline] = {
    baseline.name: baseline
    for baseline in (
        Baseline("mpc", "masked MPC", _mpc, period=MPC_PERIOD),
        Baseline("mpc_paper", "masked MPC, the paper's horizon", _mpc_paper, period=MPC_PERIOD),
        Baseline("mink", "differential IK with collision avoidance (mink)", _mink),
        Baseline("mink_low_pass", "mink behind the MPC's low-pass", _mink, SmoothedHandIntent),
        Baseline("dls", "damped least squares, whole body", _whole_body),
        Baseline("dls_arm", "damped least squares on the arm, nominal base", _nominal_base),
        Baseline("decoupled", "decoupled base and arm", _decoupled),
        Baseline("blended", "blended control, α = 0.5", _blended),
        Baseline("direct", "direct joint control", _direct, JointIntent),
        Baseline("cbf_filter", "CBF safety filter on joint commands", _cbf, JointIntent),
        Baseline(
            "safety_filter",
            "multi-step safety filter on joint commands",
            _filter,
            JointIntent,
            _FILTER_PERIOD,
        ),
    )
}
"""All that this floor can build; the RL baseline comes from the floor above."""
