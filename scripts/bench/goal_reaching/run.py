"""Runs the benchmark: every controller on every goal under every profile, goal by goal."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from handrail.collect.execution.execution import Execution
from handrail.collect.execution.job import Job
from handrail.collect.world.scene import Scene
from handrail.collect.world.tasks.goal_reaching import sample_goal
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.controller import Controller
from handrail.controllers.numerics.threads import single_threaded
from handrail.controllers.robot.model import Pose, load_model
from handrail.datasets.presentation.terminal import Terminal
from handrail.scripts.bench.goal_reaching.config import Baseline, BenchmarkConfig
from handrail.scripts.bench.goal_reaching.episode import Conditions, run_episode
from handrail.scripts.bench.goal_reaching.metrics import Trace, measure
from handrail.scripts.bench.goal_reaching.scenes import cluttered_floor, empty_floor

_PRELOAD = ("handrail.scripts.bench.goal_reaching.run",)
_PATHS = 12  # goals whose paths are kept, for drawing
_EVERY = 5  # steps between two points of a path


@dataclass(frozen=True)
class BenchEpisode:
    """The row of an episode, and for some goals the paths of base and hand seen from above, (k, 2) each."""

    row: dict[str, Any]
    paths: tuple[FloatArray, ...] = ()


def goals(config: BenchmarkConfig) -> list[Pose]:
    """Return the goals of a seed; the first ones do not depend on how many there are."""
    rng = np.random.default_rng(config.seed)
    return [sample_goal(rng) for _ in range(config.goals)]


def conditions(config: BenchmarkConfig, index: int, profile: str) -> Conditions:
    """Return what a goal's episodes are run under: goal, obstacles and command noise of the seed."""
    goal = goals(config)[index]
    scene = empty_floor()
    if config.clutter:
        scene = cluttered_floor(load_model(), goal, np.random.default_rng([config.seed, index, 1]))
    return Conditions(goal, scene, config, profile, seed=(config.seed, index, 2))


def available(
    baselines: Mapping[str, Baseline], config: BenchmarkConfig
) -> tuple[tuple[Baseline, ...], dict[str, str]]:
    """Return who can take part, and why the others cannot: with `all`, what is not installed is left out.

    Args:
        baselines: all that there are, by name.
        config: who was asked for.
    """
    present, skipped = [], {}
    for name in config.controller_names:
        try:
            _controller(baselines[name])
            present.append(baselines[name])
        except HandrailError as error:
            if config.controllers.strip() != "all":
                raise
            skipped[name] = str(error)
    if not present:
        raise HandrailError(f"controllers: none can take part: {skipped}")
    return tuple(present), skipped


def run(
    config: BenchmarkConfig, baselines: tuple[Baseline, ...], console: Terminal | None = None
) -> list[BenchEpisode]:
    """Run everything and return the episodes, by goal.

    Args:
        config: what to run.
        baselines: who takes part.
        console: to show how far it is; nothing without one.
    """
    jobs = [
        Job(f"goal {index} {profile}", run_goal, (config, baselines, index, profile), size=len(baselines))
        for index in range(config.goals)
        for profile in config.profile_names
    ]
    found: dict[str, list[BenchEpisode]] = {}
    with Execution(config, "episodes", console, _PRELOAD) as execution:
        for result in execution.run(jobs):
            if result.error:
                raise HandrailError(f"{result.job.name}: {result.error}")
            found[result.job.name] = result.value
    return [episode for job in jobs for episode in found[job.name]]


def run_goal(
    config: BenchmarkConfig, baselines: tuple[Baseline, ...], index: int, profile: str
) -> list[BenchEpisode]:
    """Run all controllers on one goal, one after the other, so that noise hits all alike."""
    model, given = load_model(), conditions(config, index, profile)
    _warm_up(baselines, config)
    collision = CollisionModel(model, given.scene.obstacles())
    episodes = []
    for baseline in baselines:
        trace = _trace(baseline, given)
        row = {"goal": index, "profile": profile, "controller": baseline.name}
        row |= measure(trace, collision, len(model.description.base.joints))
        paths = (trace.q[::_EVERY, :2], trace.hand[::_EVERY, :2]) if index < _PATHS else ()
        episodes.append(BenchEpisode(row, paths))
    return episodes


def trace_of(config: BenchmarkConfig, baseline: Baseline, index: int) -> tuple[Conditions, Trace]:
    """Return what a controller does on one goal under the first profile, for a closer look."""
    given = conditions(config, index, config.profile_names[0])
    return given, _trace(baseline, given)


def _trace(baseline: Baseline, given: Conditions) -> Trace:
    with single_threaded():
        return run_episode(load_model(), baseline, _controller(baseline), given)


@lru_cache(maxsize=32)
def _controller(baseline: Baseline) -> Controller:
    """Return a baseline's controller, built once a process."""
    return baseline.controller(load_model())


@lru_cache(maxsize=32)
def _warm_up(baselines: tuple[Baseline, ...], config: BenchmarkConfig) -> None:
    """Let everything that is built at its first use be built, outside of any measured time."""
    model = load_model()
    here, short = model.pose(model.description.home), replace(config, early_stop=True)
    for baseline in baselines:
        _trace(baseline, Conditions(here, Scene(), short))
