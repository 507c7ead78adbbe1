"""The controllers that a teleop mode can choose from; light to import."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from handrail.controllers.registry import Buildable, Registry, resolved


@dataclass(frozen=True)
class ControllerSpec(Buildable):
    """A controller: one entry makes it, by `(model, period [s]) -> Controller`."""

    protects: bool = False  # whether it keeps more than the joints' limits
    fits: Callable[[Any], bool] = lambda robot: True  # whether it can drive a robot, by its description
    objectives: bool = False
    """Whether `build` also takes what robot and task bring, `(model, period, objectives)`."""
    aims: bool = False
    """Whether it needs the place that the hand is to be brought to."""


def _mpc(name: str, kind: str, help: str, aims: bool = False, **settings: float) -> ControllerSpec:
    """Return the spec of a kind of the masked MPC, `module:name`, with some settings of its own."""

    def build(model: Any, period: float, objectives: tuple[Any, ...]) -> Any:
        from handrail.controllers.ocp.settings import MpcSettings

        settings_of = MpcSettings.of(model.description.world.scale, **settings)
        mpc = resolved(f"{_HERE}.mpc.{kind}")(model, settings_of, objectives)
        mpc.settings.check_period(period, "control rate [Hz]")
        return mpc

    return ControllerSpec(name, build, help, protects=True, objectives=True, aims=aims)


def _spec(name: str, where: str, help: str, protects: bool = False) -> ControllerSpec:
    """Return the spec of a controller, `module:name`, that takes no objectives."""
    return ControllerSpec(name, f"{_HERE}.{where}", help, protects)


_HERE = "handrail.controllers"
CONTROLLERS = Registry(
    "controller",
    ControllerSpec,
    (
        _mpc("mpc", "masked_mpc:MaskedMpc", "the masked MPC"),
        _mpc("blended", "blended:BlendedMpc", "the masked MPC of an operator and an actor", aims=True),
        _mpc("mpc_one_stage", "masked_mpc:MaskedMpc", "the masked MPC of one stage, no horizon", horizon=1),
        _spec("direct", "baselines.direct:DirectController", "clipped to joint limits"),
        _spec(
            "dls",
            "baselines.twist_completion:least_squares_controller",
            "damped least squares of the whole body, clipped to joint limits",
        ),
        _spec(
            "dls_base",
            "baselines.twist_completion:base_first_controller",
            "damped least squares with the masked MPC's weights: the base before the arm",
        ),
        _spec("filter", "mpc.safety_filter:safety_filter", "multi-step safety filter", protects=True),
        _spec("cbf", "baselines.cbf_filter:CbfFilter", "one-step safety filter", protects=True),
        _spec("split", "baselines.unprotected:split_controller", "inverse kinematics of the arm alone"),
    ),
)
