"""Lets scripted operators do tasks in teleop modes, one episode after the other, and keeps how each went."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import cast

from handrail.collect.commands.record import episode_seed
from handrail.collect.config import SessionConfig
from handrail.collect.envs.env import HandrailEnv
from handrail.collect.experiments.trials.config import SLOW_LIMITS, SLOW_MODE, TrialsConfig
from handrail.collect.experiments.trials.file import Trial, TrialsFile
from handrail.collect.operators.scripts.scripted import ScriptedOperator
from handrail.collect.session.build import build_controller, build_env, build_mode, build_operator
from handrail.collect.session.session import Session
from handrail.datasets.recording.frames import Frame

_FPS = 20  # [Hz]
_OF_OUTCOME = (
    *("success", "failure_reason", "seconds", "frames", "contacts", "smallest_distance", "brakes"),
)


def run_trials(config: TrialsConfig, told: Callable[[Trial], None]) -> list[Trial]:
    """Run what is not in the file yet, and return every episode that was asked for, in order.

    Args:
        config: of the trials.
        told: of each episode that was run.

    Raises:
        HandrailError: a setting is wrong, or the file is of other settings.
    """
    config.check()
    file = TrialsFile(Path(config.json).expanduser(), config)
    for task in config.task_names:
        for mode in config.mode_names:
            missing = file.missing(task, mode, config.episodes)
            for trial in _run(config, task, mode, missing):
                file.add(trial)
                told(trial)
    return file.trials(config.task_names, config.mode_names, config.episodes)


def _run(config: TrialsConfig, task: str, mode: str, episodes: Sequence[int]) -> Iterator[Trial]:
    """Yield how the episodes of a task in a mode went; person `i mod persons` does episode i."""
    if not episodes:
        return
    limit = SLOW_LIMITS.get(task, 0.0) if mode == SLOW_MODE else 0.0
    settings = [
        SessionConfig(
            task=task, mode=mode, robot=config.robot, noise=config.noise, person=person, time_limit=limit
        )
        for person in range(config.persons)
    ]
    env = build_env(settings[0], _FPS)
    try:
        watched = [_watched(each, env) for each in settings]
        for episode in episodes:
            session, hands = watched[episode % config.persons]
            outcome = session.run(episode_seed(config.seed, episode))
            went = {name: getattr(outcome, name) for name in _OF_OUTCOME}
            own = {"switches": hands.switches, "switching": hands.away / _FPS}
            yield Trial(task, mode, episode, episode % config.persons, **went, **own)
    finally:
        env.close()


def _watched(config: SessionConfig, env: HandrailEnv) -> "tuple[Session, _Hands]":
    mode = build_mode(config, env.model)
    operator = cast(ScriptedOperator, build_operator(config, mode, env.model))
    hands = _Hands(operator)
    return Session(env, build_controller(mode, env.model, env.fps, config.task), operator, [hands]), hands


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
