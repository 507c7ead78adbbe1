"""The multi-step predictive safety filter: the masked MPC with every joint commanded."""

from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.model import RobotModel


def safety_filter(model: RobotModel, period: float = 0.05) -> MaskedMpc:
    """Return the safety filter: what is commanded passes unless a plan that keeps all limits forbids it.

    For intents whose mask is the identity on the joint channels, `channels.mask("joint")`, it is the special
    case M = I of the masked MPC: nothing is left to complete, so the optimum is the smallest correction. The
    tracking cost is that of the multi-step filter, `‖u_L - u_0‖² + Σ_{h=1}^{M-1} wʰ ‖û_h - v_h‖²`, u_L the
    command now and û_h the predicted ones. After the M tracked stages nothing but the limits counts: they are
    the way to a stop. Many steps let the filter step in earlier, to chatter less.

    Args:
        model: of the robot.
        period: of the control loop; a command is reached after it [s]. It is the length of a stage too, so
            that the first planned velocity is the filtered command.
    """
    settings = MpcSettings.of(
        model.description.world.scale,
        dt=period,
        decay=0.85,
        tracked_stages=5,
        acceleration=1e-4,  # only so that the stages that are not tracked have an optimum
        posture=0.0,
    )
    return MaskedMpc(model, settings)
