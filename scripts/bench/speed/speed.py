"""Times the controller's update case by case, beside other solvers, blocks in turn so that noise hits all."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta

from handrail.collect.flags import check_names, names
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.threads import single_threaded
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.typed import AtLeastOne, Count
from handrail.datasets.lists import Names, Numbers
from handrail.datasets.presentation.drawing import COLOURS, GREY, new_figure, png, tidy
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.atomic import write_whole
from handrail.scripts.bench.report import ReportConfig, Rows, report
from handrail.scripts.bench.speed.peers import PEERS, Peer
from handrail.scripts.bench.speed.tasks import task_row
from handrail.scripts.bench.speed.timing_loop import SpeedCase, TimingLoop, Update

DEGREES = (8, 9, 10, 13, 18, 20)
_BLOCK = 10  # consecutive updates that the peers solve too, or none of them does
_SHOWN = ("median_ms", "p99_ms", "worst_ms")
_SHARED = ("seed", "updates", "solves")
SpeedRows = Rows[dict[str, Any]]
_VERSIONS = ("handrail", "casadi", "coal", "daqp", "numpy", "pin")


@dataclass(frozen=True)
class SpeedConfig(ReportConfig):
    """Measure the controller's update over degrees of freedom, pairs and stages, beside other solvers.

    What the file of `--json` has already is not measured again.
    """

    degrees: Numbers = (9, 13, 18, 20)
    """Degrees of freedom: 8, 9, 10, 13, 18, 20."""
    pairs: Numbers = (0, 40, 120, 250, 400)
    """Collision pairs; as near to each as whole obstacles allow."""
    horizons: Numbers = (10, 20, 40)
    """Stages."""
    updates: Annotated[int, Meta(ge=10)] = 400
    """Timed updates of every case."""
    peers: Names = "all"
    """Peers timed beside it, or all that are installed: ipopt, mink, pink, own_qp, daqp, piqp, two_sources;
    empty for nothing."""
    solves: AtLeastOne = 40
    """Updates of a case whose problem the peers solve too."""
    tasks: Names = "reach,pick_place"
    """Tasks that the scripted operator does meanwhile in mode ee, in their own table; or all."""
    robots: Names = "lekiwi,ridgeback_ur10"
    """Robots that do these tasks; or all; empty for none."""
    seed: Count = 0
    """Of scenes and intents."""

    @property
    def peer_names(self) -> tuple[str, ...]:
        """The peers asked for."""
        return names(self.peers, PEERS)

    def check(self) -> None:
        """Check the settings."""
        super().check()
        if not {*self.degrees} <= {*DEGREES}:
            raise HandrailError(f"--degrees {self.degrees}: expected some of {DEGREES}")
        if min(self.horizons, default=1) < 1 or min(self.pairs, default=0) < 0:
            raise HandrailError("--horizons and --pairs: expected whole numbers from 1, and from 0")
        if self.peers:
            check_names("peer", "--peers", self.peer_names, PEERS)
        if self.robots:
            check_names("task", "--tasks", names(self.tasks, TASKS), TASKS)
            check_names("robot", "--robots", names(self.robots, ROBOTS), ROBOTS)


def cases(config: SpeedConfig) -> list[SpeedCase]:
    """Return the cases that are asked for, the cheap ones first."""
    grid = product(config.horizons, config.degrees, config.pairs)
    return [SpeedCase(degrees, pairs, horizon) for horizon, degrees, pairs in grid]


def measure(config: SpeedConfig, console: Terminal) -> SpeedRows:
    """Measure what is not in the file yet; return the rows that are there then.

    Args:
        config: what to measure.
        console: to print what is done, and which peers are left out.
    """
    head = {"format": "handrail.speed/1"} | {name: getattr(config, name) for name in _SHARED}
    rows = SpeedRows(config.json, head, dict, lambda row: row["name"], _VERSIONS)
    for case in cases(config):
        if case.name not in rows:
            rows.add(case_row(case, config, console))
            console.print(f"{case.name}: done")
    for robot, task in product(*_in_tasks(config)):
        if f"{robot} {task}" not in rows:
            rows.add(task_row(robot, task, config.updates, config.seed))
    return rows


def _in_tasks(config: SpeedConfig) -> tuple[tuple[str, ...], tuple[str, ...]]:
    return names(config.robots, ROBOTS), names(config.tasks, TASKS)


def case_row(case: SpeedCase, config: SpeedConfig, console: Terminal) -> dict[str, Any]:
    """Return the row of a case: its updates, the first one apart, and each peer's solutions."""
    loop = TimingLoop(case, config.seed)
    with single_threaded():
        warm = len(loop.run(_BLOCK))
        peers = dict(_peers(loop, config, console))
        blocks = -(-config.updates // _BLOCK)
        every, updates = max(blocks * _BLOCK // max(config.solves, _BLOCK), 1), list[Update]()
        for block in range(blocks):
            updates += (made := loop.run(_BLOCK))
            if block % every == 0:
                for peer, update in product(peers.values(), made):
                    peer.solve(update)
    plans = [update.plan for update in updates if update.plan is not None]
    return {
        "name": case.name,
        **vars(case),
        "robot": loop.model.description.name,
        "watched_pairs": loop.mpc.loop.surroundings.collision.size,
        "rows_mean": float(np.mean([plan.rows for plan in plans])),
        "braked": sum(update.status.brakes for update in updates),
        "first_ms": {"cpu": 1e3 * loop.times.cpu[0], "wall": 1e3 * loop.times.wall[0]},
        **loop.times.spreads(warm),
        "peers": {name: peer.measured() for name, peer in peers.items()},
        "load": os.getloadavg()[0],
    }


def _peers(loop: TimingLoop, config: SpeedConfig, console: Terminal) -> Iterator[tuple[str, Peer]]:
    """Yield the peers by name; with `all`, one that is not installed is left out."""
    for name in config.peer_names:
        try:
            yield name, Peer(name, loop)
        except HandrailError as error:
            if config.peers.strip() != "all":
                raise
            console.print(f"without {name}: {error}")


def speed_tables(rows: SpeedRows, config: SpeedConfig) -> list[Table]:
    """Return the table of the cases, and that of the tasks."""
    own = [rows[case.name] for case in cases(config)]
    done = [rows[f"{robot} {task}"] for robot, task in product(*_in_tasks(config))]
    caption = (
        "CPU: processor time of the thread. First: the first update of a controller that is built. A peer's"
        " median CPU, and ours on the same problems over it. mink, pink: one step of inverse kinematics for"
        f" the hand; QPs of the same updates. Cores: {os.cpu_count()}, load: {_loads([*own, *done])}."
    )
    headings = ("n", "N", "pairs", "rows", "braked", *_headings(), "first", *PEERS)
    found = [Table(headings, [_case_cells(row) for row in own], "Update of the masked MPC [ms]", caption)]
    if done:
        headings = ("robot", "task", "updates", "pairs", "rows", "braked", *_headings())
        table = [_task_cells(row) for row in done]
        found.append(Table(headings, table, "The same while a task is done [ms]"))
    return found


def _headings() -> list[str]:
    return [f"{clock} {name.removesuffix('_ms')}" for clock, name in product(("CPU", "wall"), _SHOWN)]


def _loads(rows: Sequence[Mapping[str, Any]]) -> str:
    loads = [row["load"] for row in rows]
    return f"{min(loads):.1f} to {max(loads):.1f}" if loads else "–"


def _times(row: Mapping[str, Any]) -> list[str]:
    return [f"{row[clock][name]:.2f}" for clock, name in product(("cpu", "wall"), _SHOWN)]


def _case_cells(row: Mapping[str, Any]) -> list[str]:
    counts = [str(row[name]) for name in ("degrees", "horizon", "watched_pairs")]
    shown = [_peer_cell(row["peers"].get(name)) for name in PEERS]
    first = f"{row['first_ms']['cpu']:.1f}"
    return [*counts, f"{row['rows_mean']:.0f}", str(row["braked"]), *_times(row), first, *shown]


def _peer_cell(peer: Mapping[str, Any] | None) -> str:
    if not peer:
        return "–"
    return f"{peer['cpu']['median_ms']:.2f} ({peer['ratio']:.2g})" if peer["solves"] else "too slow"


def _task_cells(row: Mapping[str, Any]) -> list[str]:
    counts = [f"{row[name]:.0f}" for name in ("updates", "watched_pairs", "rows_mean", "braked")]
    return [row["robot"], row["task"], *counts, *_times(row)]


def speed_figure(rows: SpeedRows, config: SpeedConfig) -> Any:
    """Return median and p99 over pairs, a panel for each number of stages, peers' medians as marks."""
    figure = new_figure(4.2 * len(config.horizons), 4.2)
    panels = figure.subplots(1, len(config.horizons), sharey=True, squeeze=False)[0]
    for axes, horizon in zip(panels, config.horizons, strict=True):
        for colour, degrees in zip(COLOURS, config.degrees, strict=False):
            line = [rows[SpeedCase(degrees, pairs, horizon).name] for pairs in config.pairs]
            pairs = [row["watched_pairs"] for row in line]
            medians, worst = ([row["cpu"][name] for row in line] for name in ("median_ms", "p99_ms"))
            axes.plot(pairs, medians, "o-", color=colour, ms=4, label=f"{degrees} degrees of freedom")
            axes.plot(pairs, worst, ":", color=colour, lw=1.0)
        for marker, name in zip("x+1234|", PEERS, strict=True):  # of the first robot
            line = [rows[SpeedCase(config.degrees[0], pairs, horizon).name] for pairs in config.pairs]
            points = [
                (row["watched_pairs"], row["peers"][name]["cpu"]["median_ms"])
                for row in line
                if row["peers"].get(name, {}).get("solves")
            ]
            axes.plot(*zip(*points, strict=True), marker, color=GREY, label=name) if points else None
        axes.set(title=f"{horizon} stages", xlabel="collision pairs", yscale="log")
        tidy(axes)
    panels[0].set(ylabel="an update, CPU [ms]; dotted: p99")
    panels[0].legend(fontsize=7)
    return figure


def main(config: SpeedConfig) -> int:
    """Measure, print the tables and draw the picture beside the JSON."""
    console = Terminal()
    rows = measure(config, console)
    if config.json and config.degrees and config.pairs and config.horizons:
        picture = Path(config.json).expanduser().with_suffix(".png")
        write_whole(picture, png(speed_figure(rows, config)))
        console.print(f"Written: {picture}")
    report("speed", config, speed_tables(rows, config))
    return 0
