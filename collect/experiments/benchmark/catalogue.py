"""Who takes part in the benchmark, by name; light to import."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from handrail.controllers.registry import Registry

MPC_PERIOD = 0.1  # of the protocol [s]
FILTER_PERIOD = 0.06  # [s]
_HERE, _RL = "handrail.collect.experiments.benchmark.baselines", "handrail.policies.rl.baseline"
_JOINTS, _SMOOTHED = f"{_HERE}:JointIntent", f"{_HERE}:SmoothedHandIntent"


@dataclass(frozen=True)
class Baseline:
    """A controller in the benchmark: one entry makes it. What is `module:name` is imported when it is built.

    Functions are a module's own, so that worker processes find them.

    Attributes:
        name: as on the command line.
        help: one line.
        build: `(model) -> Controller`.
        operator: what the planner's twist becomes, `(model) -> (twist, state, time) -> Intent`; made anew for
            every episode.
        period: between two updates [s]; None: the planner's.
        aim: `(controller, goal)`, tells the goal to a controller that needs to know it.
    """

    name: str
    help: str
    build: Callable[..., Any] | str
    operator: Callable[..., Any] | str = f"{_HERE}:HandIntent"
    period: float | None = None
    aim: Callable[..., Any] | str | None = None


BASELINES = Registry(
    "baseline",
    Baseline,
    (
        Baseline("mpc", "masked MPC", f"{_HERE}:mpc", period=MPC_PERIOD),
        Baseline("rl", "reinforcement-learning baseline (SAC)", f"{_RL}:build", aim=f"{_RL}:aim"),
        Baseline("mink", "differential IK with collision avoidance (mink)", f"{_HERE}:mink"),
        Baseline("mpc_paper", "masked MPC, the paper's horizon", f"{_HERE}:mpc_paper", period=MPC_PERIOD),
        Baseline("rl_low_pass", "SAC behind the MPC's low-pass", f"{_RL}:build", _SMOOTHED, aim=f"{_RL}:aim"),
        Baseline("mink_low_pass", "mink behind the MPC's low-pass", f"{_HERE}:mink", _SMOOTHED),
        Baseline("dls", "damped least squares, whole body", f"{_HERE}:whole_body"),
        Baseline("dls_arm", "damped least squares on the arm, nominal base", f"{_HERE}:nominal_base"),
        Baseline("decoupled", "decoupled base and arm", f"{_HERE}:base_following"),
        Baseline("blended", "blended control, α = 0.5", f"{_HERE}:blended"),
        Baseline("direct", "direct joint control", f"{_HERE}:direct", _JOINTS),
        Baseline("cbf_filter", "CBF safety filter on joint commands", f"{_HERE}:cbf", _JOINTS),
        Baseline(
            "safety_filter",
            "multi-step safety filter on joint commands",
            f"{_HERE}:multi_step",
            _JOINTS,
            FILTER_PERIOD,
        ),
    ),
)
