"""Times the masked MPC's updates while the scripted operator does a task: as recording runs them."""

import os
from typing import Any, cast

import numpy as np

from handrail.collect.config import SessionConfig
from handrail.collect.seeds import episode_seed
from handrail.collect.session.build import build_controller, build_env, build_mode, build_operator
from handrail.collect.session.session import Session
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.scripts.bench.speed.timing_loop import Times

_FPS = 20  # [Hz]
_COLD = 20  # updates at the beginning that are left out


class TimedController:
    """Passes everything on to a masked MPC, and takes the time of its updates; a controller.

    Attributes:
        times: of all updates.
        rows: of the distances, in every update that has a plan.
    """

    def __init__(self, mpc: MaskedMpc) -> None:
        self._mpc, self.reset, self.update_scene = mpc, mpc.reset, mpc.update_scene
        self.times, self.rows = Times(), list[int]()

    def update(self, state: State, intent: Intent) -> Command:
        """Pass it on, and take the time."""
        command = self.times.of(self._mpc.update, state, intent)
        if self._mpc.plan is not None:
            self.rows.append(self._mpc.plan.rows)
        return command


def task_row(robot: str, task: str, updates: int, seed: int) -> dict[str, Any]:
    """Return the times of at least so many updates of a robot in a task, whole episodes."""
    config = SessionConfig(task=task, mode="ee", robot=robot)
    env = build_env(config, _FPS)
    try:
        mode = build_mode(config, env.model)
        mpc = cast(MaskedMpc, build_controller(mode, env.model, env.fps, task))
        operator = build_operator(config, mode, env.model)
        timed, outcomes = TimedController(mpc), []
        while len(timed.times.cpu) < updates + _COLD:
            outcomes.append(Session(env, timed, operator).run(episode_seed(seed, len(outcomes))))
    finally:
        env.close()
    return {
        "name": f"{robot} {task}",
        "robot": robot,
        "task": task,
        "updates": len(timed.times.cpu) - _COLD,
        "episodes": len(outcomes),
        "successes": sum(outcome.success for outcome in outcomes),
        "braked": sum(outcome.brakes for outcome in outcomes),
        "watched_pairs": mpc.loop.surroundings.collision.size,
        "rows_mean": float(np.mean(timed.rows)),
        **timed.times.spreads(_COLD),
        "load": os.getloadavg()[0],
    }
