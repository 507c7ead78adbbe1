"""The reinforcement-learning baseline's entries in the goal-reaching benchmark."""

from collections.abc import Mapping
from typing import cast

from handrail.collect.experiments.benchmark.baselines import Baseline, SmoothedHandIntent
from handrail.collect.tasks.goal_reaching import Goal
from handrail.controllers.interface.controller import Controller
from handrail.controllers.robot.model import RobotModel
from handrail.policies.rl.controller import RlController


def _build(model: RobotModel) -> Controller:
    return RlController(model)


def _aim(controller: Controller, goal: Goal) -> None:
    """Tell it the goal: the baseline's observation has it."""
    cast(RlController, controller).aim(goal)


RL_BASELINES: Mapping[str, Baseline] = {
    baseline.name: baseline
    for baseline in (
        Baseline("rl", "reinforcement-learning baseline (SAC)", _build, aim=_aim),
        Baseline("rl_low_pass", "SAC behind the MPC's low-pass", _build, SmoothedHandIntent, aim=_aim),
    )
}
