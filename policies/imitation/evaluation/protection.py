"""The controller that stands between a policy and the robot."""

from collections.abc import Mapping

from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_controller
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.baselines.unprotected import unprotected_controller
from handrail.controllers.interface.controller import Controller
from handrail.controllers.robot.model import RobotModel
from handrail.policies.imitation.evaluation.conditions import own_protection

_STAND_IN: Mapping[str, str] = {
    "mpc": "joints",
    "filter": "direct_filtered",
}  # the mode whose controller it is


def build_protection(protection: str, mode: str, task: str, model: RobotModel, fps: float) -> Controller:
    """Return the controller of an arm.

    An intent under its mode's own protection gets that mode's very controller. Otherwise `mpc` is the masked
    MPC with the objectives that the task brings, `filter` the multi-step safety filter. `none` keeps the
    limits of the joints and nothing else: joint velocities are clipped, a partial intent is completed by
    damped least squares.

    Args:
        protection: `none`, `mpc`, `filter`, or another that the mode has itself.
        mode: whose intents come; empty for joint velocities.
        task: what is done.
        model: of the robot.
        fps: control rate [Hz].
    """
    if mode and protection == own_protection(mode):
        return build_controller(MODES.find(mode), model, fps, task)
    if protection == "none":
        complete = unprotected_controller if mode else DirectController
        return complete(model, 1.0 / fps)
    return build_controller(MODES[_STAND_IN[protection]], model, fps, task)
