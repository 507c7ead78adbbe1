"""Settings of the bench `goal_reaching`, and who takes part in it, by name; light to import."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Any

from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.flags import check_names, names, one_of
from handrail.controllers.registry import Registry, resolved
from handrail.controllers.typed import AtLeastOne, Count
from handrail.datasets.lists import Names
from handrail.scripts.bench.report import ReportConfig

_HERE = "handrail.scripts.bench.goal_reaching.baselines"
_DIRECT = "handrail.controllers.baselines.direct:DirectController"
_CBF = "handrail.controllers.baselines.cbf_filter:CbfFilter"
_FILTER = "handrail.controllers.mpc.safety_filter:safety_filter"
_DLS = "handrail.controllers.baselines.twist_completion:least_squares_controller"
_DLS_BASE = "handrail.controllers.baselines.twist_completion:base_first_controller"
_MINK = "handrail.collect.world.mink:MinkController"
_RL = "handrail.policies.rl.controller:RlController"
TAKE_UP = (1.0, 0.65)  # time constants of the low-pass, of the hand's translation and turn [s]
_JOINTS, _SMOOTHED = f"{_HERE}:joint_intent", f"{_HERE}:smoothed_hand_intent"


@dataclass(frozen=True)
class Baseline:
    """A controller in the benchmark: one entry makes it. A `module:name` is imported when it is built.

    Functions are a module's own, so that worker processes find them.
    """

    name: str  # as on the command line
    help: str  # one line
    build: Callable[..., Any] | str  # `(model, period [s]) -> Controller`
    operator: Callable[..., Any] | str = f"{_HERE}:hand_intent"
    """The operator: `(model) -> (twist, state, time) -> Intent`, anew an episode."""
    period: float | None = None  # between two updates [s]; None: the planner's
    aims: bool = False  # whether the controller needs to know the goal; then it has `aim(goal)`
    lag: tuple[float, float] = (0.0, 0.0)
    """Time constants of a low-pass before it, of the hand's translation and turn [s]; a planner that sees the
    hand knows them."""

    def controller(self, model: Any) -> Any:
        """Return the controller of a robot."""
        from handrail.collect.world.tasks.goal_reaching import STEP

        return resolved(self.build)(model, self.period or STEP)


BASELINES = Registry(
    "baseline",
    Baseline,
    (
        Baseline("mpc", "masked MPC", f"{_HERE}:mpc", period=0.1, lag=TAKE_UP),
        Baseline("rl", "reinforcement-learning baseline (SAC)", _RL, aims=True),
        Baseline("mink", "differential IK with collision avoidance (mink)", _MINK),
        Baseline("mpc_paper", "masked MPC, the paper's horizon", f"{_HERE}:mpc_paper", period=0.09),
        Baseline("rl_low_pass", "SAC behind the MPC's low-pass", _RL, _SMOOTHED, aims=True, lag=TAKE_UP),
        Baseline("mink_low_pass", "mink behind the MPC's low-pass", _MINK, _SMOOTHED, lag=TAKE_UP),
        Baseline("mpc_one_stage", "mpc_paper without its horizon", f"{_HERE}:mpc_one_stage", period=0.09),
        Baseline("dls_base", "damped least squares, mpc_paper's weights", _DLS_BASE),
        Baseline("dls", "damped least squares, whole body", _DLS),
        Baseline("dls_arm", "damped least squares on the arm, nominal base", f"{_HERE}:nominal_base"),
        Baseline("decoupled", "decoupled base and arm", f"{_HERE}:base_following"),
        Baseline("blended", "mpc_paper and an actor", f"{_HERE}:blended", aims=True, period=0.09),
        Baseline("direct", "dls as joint commands, no controller", _DIRECT, _JOINTS),
        Baseline("cbf_filter", "CBF safety filter on joint commands", _CBF, _JOINTS),
        Baseline("safety_filter", "multi-step safety filter on joint commands", _FILTER, _JOINTS, 0.06),
    ),
)


PROFILES = ("nominal", "fast15", "fast2", "fast3", "steps", "noise", "delay", "dropouts", "quantised")


@dataclass(frozen=True)
class BenchmarkConfig(ReportConfig, ExecutionConfig):
    """Run the paper's goal-reaching benchmark: every controller on the same goals, with the same planner."""

    controllers: Annotated[Names, one_of(BASELINES)] = "all"
    """Which controllers, or all."""
    goals: AtLeastOne = 100
    """Goals, the same for every controller."""
    seed: Count = 1
    """Seed of the goals, obstacles and command noise."""
    profile: Names = "nominal"
    """How the planner's twist arrives, one or more, or all: nominal, fast15, fast2, fast3, steps, noise,
    delay, dropouts, quantised."""
    physics: bool = True
    """MuJoCo physics; without it an ideal robot that does what it is told."""
    clutter: bool = False
    """Cylinders on the floor, between start and goal too."""
    early_stop: bool = True
    """End an episode at its success, as the protocol says; else 4 s after the planner's last step."""
    closed_loop: bool = False
    """The planner sees the hand and corrects its errors, instead of running open loop."""
    workers: int = field(default=1, kw_only=True)
    """Processes that share the work; 0 for as many as there are cores, which makes all times longer."""
    video: bool = True
    """Whether the page has an example, a strip of pictures (needs OpenGL)."""

    @property
    def controller_names(self) -> tuple[str, ...]:
        """The controllers asked for."""
        return names(self.controllers, BASELINES)

    @property
    def profile_names(self) -> tuple[str, ...]:
        """The profiles asked for."""
        return names(self.profile, PROFILES)

    @property
    def label(self) -> str:
        """A name of this kind of run: what is special about it, and the seed."""
        profiles = self.profile_names
        kinds = ["profiles"] if set(profiles) == set(PROFILES) else list(profiles)
        kinds += [name for name in ("clutter", "closed_loop") if getattr(self, name)]
        kinds += [word for word, there in (("whole", self.early_stop), ("ideal", self.physics)) if not there]
        return "_".join([*kinds, f"seed_{self.seed}"])

    def check(self) -> None:
        """Check what can be checked without loading anything heavy."""
        super().check()
        check_names("controller", "--controllers", self.controller_names, BASELINES)
        check_names("profile", "--profile", self.profile_names, PROFILES)
        self.check_execution()
