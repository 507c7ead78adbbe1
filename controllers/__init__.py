"""The robot model, intent, the masked optimal control problem, its solvers and the controllers.

The names of `__all__` are imported from here: `from handrail.controllers import MaskedMpc, Intent, State`.
Each is loaded when it is first used, so that importing the package is quick.
"""

from typing import TYPE_CHECKING

from handrail.controllers.lazy import lazily

if TYPE_CHECKING:
    from handrail.controllers.baselines.cbf_filter import CbfFilter as CbfFilter
    from handrail.controllers.baselines.direct import DirectController as DirectController
    from handrail.controllers.errors import HandrailError as HandrailError
    from handrail.controllers.interface.channels import Channels as Channels
    from handrail.controllers.interface.command import Command as Command
    from handrail.controllers.interface.command import Diagnostics as Diagnostics
    from handrail.controllers.interface.command import Status as Status
    from handrail.controllers.interface.controller import Controller as Controller
    from handrail.controllers.interface.controller import State as State
    from handrail.controllers.interface.intent import Intent as Intent
    from handrail.controllers.mpc.masked_mpc import MaskedMpc as MaskedMpc
    from handrail.controllers.mpc.safety_filter import safety_filter as safety_filter
    from handrail.controllers.ocp.settings import MpcSettings as MpcSettings
    from handrail.controllers.robot.model import Pose as Pose
    from handrail.controllers.robot.model import RobotModel as RobotModel
    from handrail.controllers.robot.model import load_model as load_model
    from handrail.controllers.robot.shape import Obstacle as Obstacle
    from handrail.controllers.robot.shape import Shape as Shape

__all__, __getattr__ = lazily(__name__, __file__)  # pyright: ignore[reportUnsupportedDunderAll]
