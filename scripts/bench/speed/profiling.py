"""Times the controller's update against other solvers, interleaved so that noise hits all alike."""

import os
from importlib import metadata
from typing import Any

import numpy as np

from handrail.collect.flags import names
from handrail.collect.world.mink import ACTIVATION_DISTANCE
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.numerics.threads import single_threaded
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.scripts.bench.report import machine, report, spread
from handrail.scripts.bench.speed.baselines import Rival, converged, mink
from handrail.scripts.bench.speed.config import ProfileConfig
from handrail.scripts.bench.speed.qp import compare_qp
from handrail.scripts.bench.speed.tables import profile_tables
from handrail.scripts.bench.speed.tasks import time_tasks
from handrail.scripts.bench.speed.timing_loop import (
    CASES,
    SpeedCase,
    TimingLoop,
    Update,
    longer,
)

_BLOCK = 10  # updates of one loop before the next has its turn
_SHORT = 0.05  # beyond the margin: a mink that looks no farther than it needs to [m]
_GROWTH = (
    *longer(20, 40),
    SpeedCase("pairs_50", obstacles=2),
    SpeedCase("pairs_200", obstacles=18),
    SpeedCase("pairs_300", obstacles=30),
    SpeedCase("no_collision_10_dof", own="none", robot="ridgeback_panda"),
    SpeedCase("pairs_40_10_dof", obstacles=2, robot="ridgeback_panda"),
)


def profile(config: ProfileConfig) -> dict[str, Any]:
    """Measure; return everything as one dictionary.

    Args:
        config: how much to measure.
    """
    load = os.getloadavg()[0]
    cases = (*CASES, *(_GROWTH if config.growth else ()))
    loops = {case.name: TimingLoop(case, config.seed) for case in cases}
    updates: dict[str, list[Update]] = {name: [] for name in loops}
    baselines = _baselines(config, loops) if config.rivals else {}
    with single_threaded():
        for block in range(1 - (-config.updates // _BLOCK)):
            for name, loop in loops.items():
                made = loop.run(_BLOCK)
                if block == 0:
                    continue  # nothing is warm yet
                updates[name] += made
                for baseline in baselines.values():
                    if baseline.loop is loop:
                        baseline.run(made)
        qp = compare_qp(config.qps, config.seed) if config.qps else {}
        tasks = names(config.tasks, TASKS)
        in_tasks = time_tasks(names(config.robots, ROBOTS), tasks, config.updates, config.seed)
    ours = {case.name: _case(case, updates[case.name]) for case in cases}
    return {
        **{case.name: ours.pop(case.name) for case in CASES},
        **{name: baseline.measured()["ratio"] for name, baseline in baselines.items()},
        "growth": ours,
        "tasks": in_tasks,
        "rivals": _by_case(list(baselines.values())),
        "seed": config.seed,
        "machine": machine(load),
        "versions": {name: metadata.version(name) for name in ("casadi", "coal", "daqp", "numpy", "pin")},
        "qp": qp,
    }


def _baselines(config: ProfileConfig, loops: dict[str, TimingLoop]) -> dict[str, Rival]:
    """Return what is measured besides, by the name of the ratio."""
    bare, pairs = loops["no_collision"], loops["pairs_30"]
    every, seldom = (max(config.updates // max(count, 1), 1) for count in (config.solves, config.solves // 4))
    return {
        "ratio_vs_ipopt": Rival("ipopt", bare, converged(bare), every),
        "ratio_vs_ipopt_pairs_30": Rival("ipopt", pairs, converged(pairs), seldom),
        "ratio_vs_mink": Rival("mink", pairs, mink(pairs, ACTIVATION_DISTANCE)),
        "ratio_vs_mink_short_reach": Rival("mink_short_reach", pairs, mink(pairs, _SHORT)),
    }


def _by_case(baselines: list[Rival]) -> dict[str, list[dict[str, Any]]]:
    found: dict[str, list[dict[str, Any]]] = {}
    for baseline in baselines:
        found.setdefault(baseline.loop.case.name, []).append(baseline.measured())
    return found


def _case(case: SpeedCase, updates: list[Update]) -> dict[str, Any]:
    solved = [(update, update.plan) for update in updates if update.plan is not None]
    plans = [plan for _, plan in solved]
    pairs = len(plans[0].distances)
    phases = {name: [dict(plan.phases)[name] for plan in plans] for name, _ in plans[0].phases}
    phases["rest"] = [update.seconds - sum(dict(plan.phases).values()) for update, plan in solved]
    near = [np.sum(plan.distances < update.problem.active_within) for update, plan in solved]
    return {
        **spread([update.seconds for update in updates]),
        "pairs": pairs,
        "near_mean": float(np.mean(near)),
        "rows_mean": float(np.mean([plan.rows for plan in plans])),
        "iterations_mean": float(np.mean([plan.iterations for plan in plans])),
        "smallest_distance": float(min(plan.distances.min() for plan in plans)) if pairs else None,
        "horizon": case.horizon,
        "degrees_of_freedom": len(updates[0].state.q),
        "updates": len(updates),
        "braked": sum(update.status.brakes for update in updates),
        "phases_ms": {name: 1e3 * float(np.median(seconds)) for name, seconds in phases.items()},
    }


def main(config: ProfileConfig) -> int:
    """Measure and print the tables."""
    results = profile(config)
    report("speed", config, profile_tables(results), results)
    return 0
