"""The reinforcement-learning baseline's entries in the goal-reaching benchmark."""

from collections.abc import Mapping
from typing import cast

from handrail.collect.benchmark_contenders import Contender, SmoothedHandIntent
from handrail.collect.goal_reaching import Goal
from handrail.controllers.controller import Controller
from handrail.controllers.model import RobotModel
from handrail.policies.rl_controller import RlController


def _build(model: RobotModel) -> Controller:
    return RlController(model)


def _aim(controller: Controller, goal: Goal) -> None:
    """Tell it the goal: the baseline's observation has it."""
    cast(RlController, controller).aim(goal)


RL_CONTENDERS: Mapping[str, Contender] = {
    contender.name: contender
    for contender in (
        Contender("rl", "reinforcement-learning baseline (SAC)", _build, aim=_aim),
        Contender("rl_low_pass", "SAC behind the MPC's low-pass", _build, SmoothedHandIntent, aim=_aim),
    )
}
