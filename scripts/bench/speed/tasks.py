"""Times the masked MPC's updates while the scripted operator does tasks: as recording runs them."""

from time import perf_counter, thread_time
from typing import Any, cast

import numpy as np

from handrail.collect.commands.recording import episode_seed
from handrail.collect.config import SessionConfig
from handrail.collect.session.build import build_controller, build_env, build_mode, build_operator
from handrail.collect.session.session import Session
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.shape import Obstacle
from handrail.scripts.bench.report import spread

_FPS = 20  # [Hz]
_COLD = 20  # updates at the beginning that are left out


class TimedController:
    """Passes everything on to a masked MPC, and takes the time of its updates; a controller.

    Attributes:
        cpu: processor time of this thread, update by update [s]: other programs lengthen it less.
        wall: time on the clock [s].
        phases: of every update that has a plan, on the clock [s].
        rows: of the distances, in the same updates.
        braked: updates that braked.
    """

    def __init__(self, mpc: MaskedMpc) -> None:
        self._mpc = mpc
        self.cpu: list[float] = []
        self.wall: list[float] = []
        self.phases: list[dict[str, float]] = []
        self.rows: list[int] = []
        self.braked = 0

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Pass it on."""
        self._mpc.reset(obstacles)

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Pass it on."""
        self._mpc.update_scene(obstacles)

    def update(self, state: State, intent: Intent) -> Command:
        """Pass it on, and take the time."""
        wall, cpu = perf_counter(), thread_time()
        command = self._mpc.update(state, intent)
        self.cpu.append(thread_time() - cpu)
        self.wall.append(perf_counter() - wall)
        self.braked += command.diagnostics.status.brakes
        if (plan := self._mpc.plan) is not None:
            phases = dict(plan.phases)
            self.phases.append({**phases, "rest": self.wall[-1] - sum(phases.values())})
            self.rows.append(plan.rows)
        return command


def time_tasks(
    robots: tuple[str, ...], tasks: tuple[str, ...], updates: int, seed: int
) -> list[dict[str, Any]]:
    """Return times of at least so many updates of every robot in every task, whole episodes."""
    return [_timed(robot, task, updates, seed) for robot in robots for task in tasks]


def _timed(robot: str, task: str, updates: int, seed: int) -> dict[str, Any]:
    config = SessionConfig(task=task, mode="ee", robot=robot)
    env = build_env(config, _FPS)
    try:
        mode = build_mode(config, env.model)
        mpc = cast(MaskedMpc, build_controller(mode, env.model, env.fps, task))
        operator = build_operator(config, mode, env.model)
        timed, outcomes = TimedController(mpc), []
        while len(timed.cpu) < updates + _COLD:
            outcomes.append(Session(env, timed, operator).run(episode_seed(seed, len(outcomes))))
    finally:
        env.close()
    return {
        "robot": robot,
        "task": task,
        "updates": len(timed.cpu) - _COLD,
        "episodes": len(outcomes),
        "successes": sum(outcome.success for outcome in outcomes),
        "braked": timed.braked,
        "pairs": mpc.loop.surroundings.collision.size,
        "rows_mean": float(np.mean(timed.rows)),
        "cpu": spread(timed.cpu[_COLD:]),
        "wall": spread(timed.wall[_COLD:]),
        "phases_ms": {
            name: 1e3 * float(np.median([phases[name] for phases in timed.phases]))
            for name in timed.phases[0]
        },
    }
