"""The controllers that a teleop mode can choose from; light to import."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from handrail.controllers.registry import Registry


@dataclass(frozen=True)
class ControllerSpec:
    """A controller: one entry makes it."""

    name: str  # that a teleop mode says
    build: Callable[..., Any] | str  # `(model, period [s]) -> Controller`, or where that is, `module:name`
    help: str  # what becomes of the command, in one line
    protects: bool = False  # whether it keeps more than the joints' limits
    objectives: bool = False
    """Whether `build` also takes what robot and task bring, `(model, period, objectives)`."""


def _masked_mpc(model: Any, period: float, objectives: tuple[Any, ...], **settings: float) -> Any:
    from handrail.controllers.mpc.masked_mpc import MaskedMpc
    from handrail.controllers.ocp.settings import MpcSettings

    settings_of = MpcSettings.of(model.description.world.scale, **settings)
    mpc = MaskedMpc(model, settings_of, objectives)
    mpc.settings.check_period(period, "control rate [Hz]")
    return mpc


_HERE = "handrail.controllers"
CONTROLLERS = Registry(
    "controller",
    ControllerSpec,
    (
        ControllerSpec("mpc", _masked_mpc, "the masked MPC", protects=True, objectives=True),
        ControllerSpec(
            "mpc_one_stage",
            partial(_masked_mpc, horizon=1),
            "the masked MPC without its horizon: one stage",
            protects=True,
            objectives=True,
        ),
        ControllerSpec("direct", f"{_HERE}.baselines.direct:DirectController", "clipped to joint limits"),
        ControllerSpec(
            "dls",
            f"{_HERE}.baselines.twist_completion:least_squares_controller",
            "damped least squares of the whole body, clipped to joint limits",
        ),
        ControllerSpec(
            "dls_base",
            f"{_HERE}.baselines.twist_completion:base_first_controller",
            "damped least squares with the masked MPC's weights: the base before the arm",
        ),
        ControllerSpec(
            "filter", f"{_HERE}.mpc.safety_filter:safety_filter", "multi-step safety filter", protects=True
        ),
        ControllerSpec(
            "cbf", f"{_HERE}.baselines.cbf_filter:CbfFilter", "one-step safety filter", protects=True
        ),
        ControllerSpec(
            "split",
            f"{_HERE}.baselines.unprotected:split_controller",
            "inverse kinematics of the arm alone",
        ),
    ),
)
