"""Lets scripted operators do tasks in teleop modes, and keeps how each episode went."""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import cast

from handrail.collect.commands.recording import episode_seed
from handrail.collect.config import SessionConfig
from handrail.collect.envs.env import HandrailEnv
from handrail.collect.execution.execution import Execution
from handrail.collect.execution.job import Job
from handrail.collect.operators.scripts.scripted import ScriptedOperator
from handrail.collect.session.build import build_controller, build_env, build_mode, build_operator
from handrail.collect.session.session import Session
from handrail.controllers.errors import HandrailError
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.recording.frames import Frame
from handrail.scripts.bench.operators.config import SLOW_LIMITS, SLOW_MODE, TrialsConfig
from handrail.scripts.bench.operators.file import Trial, TrialsFile
from handrail.scripts.bench.operators.table import trials_table, write_page

_PRELOAD = ("handrail.scripts.bench.operators.trials",)
_FPS = 20  # [Hz]
_OF_OUTCOME = (
    *("success", "failure_reason", "seconds", "frames", "contacts", "smallest_distance", "brakes"),
)


def run_trials(
    config: TrialsConfig, told: Callable[[Trial], None], console: Terminal | None = None
) -> list[Trial]:
    """Run what is not in the file yet, and return every episode that was asked for, in order.

    Args:
        config: of the trials.
        told: of each episode that was run.
        console: to show how far it is; nothing without one.

    Raises:
        HandrailError: a setting is wrong, the file is of other settings, or an episode cannot be run.
    """
    config.check()
    file = TrialsFile(Path(config.json).expanduser(), config)
    settings = replace(config, workers=1, ray="", json="trials.json", page="")  # what an episode depends on
    jobs = [
        Job(f"{task} {mode} {episode}", run_trial, (settings, task, mode, episode))
        for task in config.task_names
        for mode in config.mode_names
        for episode in file.missing(task, mode, config.episodes)
    ]
    with Execution(config, "episodes", console, _PRELOAD) as execution:
        for result in execution.run(jobs):
            if result.error:
                raise HandrailError(f"{result.job.name}: {result.error}")
            file.add(result.value)
            told(result.value)
    return file.trials(config.task_names, config.mode_names, config.episodes)


def run_trial(config: TrialsConfig, task: str, mode: str, episode: int) -> Trial:
    """Return how one episode went; person `i mod persons` does episode i."""
    person = episode % config.persons
    session, hands = _watched(config, task, mode, person)
    outcome = session.run(episode_seed(config.seed, episode))
    went = {name: getattr(outcome, name) for name in _OF_OUTCOME}
    own = {"switches": hands.switches, "switching": hands.away / _FPS}
    return Trial(task, mode, episode, person, **went, **own)


@lru_cache(maxsize=16)
def _watched(config: TrialsConfig, task: str, mode: str, person: int) -> "tuple[Session, _Hands]":
    """Return the session of a person, built once a process."""
    limit = SLOW_LIMITS.get(task, 0.0) if mode == SLOW_MODE else 0.0
    settings = SessionConfig(
        task=task, mode=mode, robot=config.robot, noise=config.noise, person=person, time_limit=limit
    )
    env = _env(replace(settings, person=0))
    taken = build_mode(settings, env.model)
    operator = cast(ScriptedOperator, build_operator(settings, taken, env.model))
    hands = _Hands(operator)
    return Session(env, build_controller(taken, env.model, env.fps, task), operator, [hands]), hands


@lru_cache(maxsize=2)
def _env(config: SessionConfig) -> HandrailEnv:
    """Return the environment of a task in a mode, built once a process."""
    return build_env(config, _FPS)


class _Hands:
    """Counts how often an operator changes to other channels, and the frames their hands are away for it."""

    def __init__(self, operator: ScriptedOperator) -> None:
        self._operator = operator

    def begin(self, env: HandrailEnv, seed: int) -> None:
        self._mask = b""
        self.switches = self.away = 0

    def see(self, frame: Frame) -> None:
        mask = frame.intent.mask.tobytes()
        self.switches += self._mask not in (b"", mask)
        self.away += frame.intent.time < self._operator.free_at
        self._mask = mask


def main(config: TrialsConfig) -> int:
    """Run the trials and print the tables."""
    console = Terminal()
    trials = run_trials(
        config,
        lambda done: console.print(
            f"{done.task} {done.mode} {done.episode}: {done.failure_reason or 'done'}, {done.seconds:.1f} s"
        ),
    )
    for task in config.task_names:
        console.print(trials_table(trials, config.mode_names, task))
    if config.page:
        write_page(trials, config)
        console.print(f"Written: {config.page}")
    return 0
