"""Times the controller's update against its rivals, interleaved so that noise hits all alike."""

import json
import os
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from handrail.collect.experiments.profiling.config import ProfileConfig
from handrail.collect.experiments.profiling.qp import compare_qp
from handrail.collect.experiments.profiling.rivals import Converged, Mink
from handrail.collect.experiments.profiling.timing_loop import Case, TimingLoop, Update, times
from handrail.controllers.numerics.threads import single_threaded
from handrail.controllers.ocp.settings import MpcSettings
from handrail.datasets.storage.atomic import write_whole

_BLOCK = 10  # updates of one lane before the next has its turn
_SHORT_REACH = 0.05  # beyond the margin: a mink that looks no farther than it needs to [m]

_MAIN = (
    Case("no_collision", own="none"),
    Case("pairs_30", own="few", obstacles=2),
    Case("pairs_100", obstacles=7),
)
_GROWTH = (
    *(Case(f"no_collision_horizon_{n}", own="none", horizon=n) for n in (20, 40)),
    *(Case(f"pairs_30_horizon_{n}", own="few", obstacles=2, horizon=n) for n in (20, 40)),
    *(Case(f"pairs_100_horizon_{n}", obstacles=7, horizon=n) for n in (20, 40)),
    Case("pairs_50", obstacles=2),
    Case("pairs_200", obstacles=18),
    Case("pairs_300", obstacles=30),
    Case("no_collision_10_dof", own="none", robot="ridgeback_panda"),
    Case("pairs_40_10_dof", obstacles=2, robot="ridgeback_panda"),
)


class Profile:
    """All lanes and their rivals.

    Args:
        config: how much to measure.
    """

    def __init__(self, config: ProfileConfig) -> None:
        self._config = config
        cases = (*_MAIN, *(_GROWTH if config.growth else ()))
        self._lanes = {case.name: TimingLoop(case, config.seed) for case in cases}
        self._updates: dict[str, list[Update]] = {name: [] for name in self._lanes}
        self._rivals: dict[str, list[Converged | Mink]] = {name: [] for name in self._lanes}
        if config.rivals:
            self._add_rivals()

    def run(self) -> dict[str, Any]:
        """Measure; return everything as one dictionary."""
        load = os.getloadavg()[0]
        with single_threaded():
            blocks = -(-self._config.updates // _BLOCK)
            for block in range(blocks + 1):
                for name, lane in self._lanes.items():
                    self._turn(name, lane, warm_up=block == 0)
            qp = compare_qp(self._config.qps, self._config.seed) if self._config.qps else {}
        return {**self._results(load), "qp": qp}

    def _add_rivals(self) -> None:
        settings = MpcSettings()
        for name, solves in (("no_collision", self._config.solves), ("pairs_30", self._config.solves // 4)):
            lane, every = self._lanes[name], max(self._config.updates // max(solves, 1), 1)
            self._rivals[name].append(Converged(lane, every))
        lane = self._lanes["pairs_30"]
        for reach in (settings.activation_distance, _SHORT_REACH):
            self._rivals["pairs_30"].append(Mink(lane, settings.margin + reach))

    def _turn(self, name: str, lane: TimingLoop, warm_up: bool) -> None:
        if lane.at_new_scene:
            lane.begin()
            for rival in self._rivals[name]:
                rival.begin(lane)
        updates = lane.run(_BLOCK)
        if warm_up:
            return
        self._updates[name] += updates
        for rival in self._rivals[name]:
            rival.run(updates)

    def _results(self, load: float) -> dict[str, Any]:
        ours = {name: _case(lane.case, self._updates[name]) for name, lane in self._lanes.items()}
        rivals = {
            name: [_rival(rival) for rival in rivals] for name, rivals in self._rivals.items() if rivals
        }
        main = {case.name for case in _MAIN}
        return {
            **{name: ours[name] for name in main},
            **_ratios(rivals),
            "growth": {name: case for name, case in ours.items() if name not in main},
            "growth_exponents": _exponents(ours) if self._config.growth else {},
            "rivals": rivals,
            "seed": self._config.seed,
            "machine": {"cores": os.cpu_count(), "load_before": load, "load_after": os.getloadavg()[0]},
            "versions": {name: metadata.version(name) for name in ("casadi", "coal", "daqp", "numpy", "pin")},
        }


def _case(case: Case, updates: list[Update]) -> dict[str, Any]:
    pairs = len(updates[0].plan.distances)
    names = [name for name, _ in updates[0].plan.phases]
    phases = {
        name: 1e3 * float(np.median([dict(update.plan.phases).get(name, 0.0) for update in updates]))
        for name in names
    }
    rest = [update.seconds - sum(seconds for _, seconds in update.plan.phases) for update in updates]
    near = [int(np.sum(u.plan.distances < u.problem.active_within)) for u in updates]
    statuses = [update.status for update in updates]
    return {
        **times([update.seconds for update in updates]),
        "pairs": pairs,
        "near_mean": float(np.mean(near)),
        "rows_mean": float(np.mean([update.plan.rows for update in updates])),
        "iterations_mean": float(np.mean([update.plan.iterations for update in updates])),
        "smallest_distance": float(min(u.plan.distances.min(initial=np.inf) for u in updates))
        if pairs
        else None,
        "horizon": case.horizon,
        "degrees_of_freedom": len(updates[0].state.q),
        "updates": len(updates),
        "braked": sum(status != "ok" for status in statuses),
        "phases_ms": {**phases, "rest": 1e3 * float(np.median(rest))},
    }


def _rival(rival: Converged | Mink) -> dict[str, Any]:
    counts = {"name": rival.name, "solves": len(rival.seconds), "failed": rival.failed}
    if not rival.seconds:
        return {**counts, "ratio": None}
    ratio = float(np.median(rival.ours) / np.median(rival.seconds))
    measured = {**counts, **times(rival.seconds), "ratio": ratio}
    return (
        {**measured, "qp_solver": rival.solver, "pairs": rival.pairs} if isinstance(rival, Mink) else measured
    )


def _ratios(rivals: dict[str, list[dict[str, Any]]]) -> dict[str, float | None]:
    """Return our median over theirs on the same problems; None for a rival that was not measured."""
    names = {
        "no_collision": ("ratio_vs_ipopt",),
        "pairs_30": ("ratio_vs_ipopt_pairs_30", "ratio_vs_mink", "ratio_vs_mink_short_reach"),
    }
    return {
        name: rivals[case][index]["ratio"] if case in rivals else None
        for case, keys in names.items()
        for index, name in enumerate(keys)
    }


def _exponents(ours: dict[str, Any]) -> dict[str, float]:
    """Return x of `time ∝ size^x` between the ends of each growth: 1 is linear."""
    longer = {
        f"horizon_{name}": (ours[name], ours[f"{name}_horizon_40"], "horizon")
        for name in ("no_collision", "pairs_30", "pairs_100")
    }
    more = {"pairs": (ours["pairs_30"], ours["pairs_300"], "pairs")}
    return {
        name: float(np.log(large["median_ms"] / small["median_ms"]) / np.log(large[by] / small[by]))
        for name, (small, large, by) in (longer | more).items()
    }


def save(results: dict[str, Any], path: str) -> None:
    """Write the results as JSON."""
    write_whole(Path(path).expanduser(), (json.dumps(results, indent=2) + "\n").encode())
