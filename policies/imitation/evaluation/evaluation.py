"""Evaluates trained policies: every checkpoint under every condition on the same declared seeds."""

import multiprocessing
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.evaluation.conditions import PolicyCondition, policy_conditions
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.file import EvaluationFile
from handrail.policies.imitation.evaluation.rollout import Load, Row, run_rollout
from handrail.policies.imitation.interface.checkpoint import load_policy

Rollout = tuple[PolicyCondition, int]  # and the seed of its episode
_Tried = tuple[PolicyCondition, Row | HandrailError]
_SAVE_EVERY = 2.0  # [s]


class UnevaluatedError(HandrailError):
    """Some policies could not be evaluated; the others were, and what they did is kept.

    Attributes:
        content: of the file.
        reasons: why not, a line for each.
    """

    def __init__(self, content: dict[str, Any], reasons: Sequence[str]) -> None:
        super().__init__("; ".join(reasons))
        self.content = content
        self.reasons = tuple(reasons)


def evaluate(
    config: EvaluateConfig, console: Console | None = None, load: Load = load_policy
) -> dict[str, Any]:
    """Run what is not in the file yet, write it, and return the content of the file.

    Every condition meets the same episodes and the same disturbances, and a rollout depends on nothing but
    its condition and seed: neither on the number of processes nor on what ran before.

    Args:
        config: what to run.
        console: for the progress bar; none without it.
        load: reads the policy of a checkpoint folder.

    Raises:
        UnevaluatedError: some policies could not be evaluated, the others were.
        HandrailError: a setting is wrong, no policy could be evaluated, or the file cannot be written.
    """
    config.check()
    conditions, refused = policy_conditions(config)
    file = EvaluationFile(config.file if config.json else None)
    file.open(conditions)
    rollouts = [(each, seed) for each in conditions for seed in config.seeds if seed not in file.done(each)]
    try:
        refused += _run_all(rollouts, config.workers, load, file, console or Console(quiet=True))
    finally:
        file.save()
    if refused and not file.content["arms"]:
        raise HandrailError("; ".join(refused))
    if refused:
        raise UnevaluatedError(file.content, refused)
    return file.content


def _run_all(
    rollouts: Sequence[Rollout], workers: int, load: Load, file: EvaluationFile, console: Console
) -> list[str]:
    """Run rollouts; return why some policies could not be."""
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    saved, successes, refused = monotonic(), 0, dict[Path, str]()
    with Progress(*columns, TextColumn("{task.fields[success]}"), console=console) as progress:
        bar = progress.add_task("rollouts", total=len(rollouts), success="")
        for count, (condition, row) in enumerate(_results(rollouts, workers, load, refused), start=1):
            file.add(condition, row)
            successes += row["success"]
            progress.update(bar, advance=1, success=f"{successes}/{count} succeeded")
            if monotonic() - saved > _SAVE_EVERY:
                file.save()
                saved = monotonic()
    return list(refused.values())


def _results(
    rollouts: Sequence[Rollout], workers: int, load: Load, refused: dict[Path, str]
) -> Iterator[tuple[PolicyCondition, Row]]:
    """Yield the rollouts as they are done, in any order; note policies that cannot be run."""
    run = _here if min(workers, len(rollouts)) <= 1 else partial(_in_processes, workers)
    for condition, row in run(rollouts, load, refused):
        if isinstance(row, HandrailError):
            refused.setdefault(condition.checkpoint.folder, str(row))
        else:
            yield condition, row


def _try(rollout: Rollout, load: Load) -> Row | HandrailError:
    """Return how a rollout went, or why it could not be run."""
    try:
        return run_rollout(*rollout, load)
    except HandrailError as error:
        return HandrailError(str(error))


def _here(rollouts: Sequence[Rollout], load: Load, refused: Mapping[Path, str]) -> Iterator[_Tried]:
    for condition, seed in rollouts:
        if condition.checkpoint.folder not in refused:
            yield condition, _try((condition, seed), load)


def _in_processes(
    workers: int, rollouts: Sequence[Rollout], load: Load, refused: Mapping[Path, str]
) -> Iterator[_Tried]:
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(workers, len(rollouts)), context) as pool:
        try:
            running = {pool.submit(_try, rollout, load): rollout[0] for rollout in rollouts}
            for done in as_completed(running):
                if not done.cancelled():
                    yield running[done], done.result()
                for future, condition in running.items() if refused else ():
                    if condition.checkpoint.folder in refused:
                        future.cancel()
        except BrokenProcessPool as error:
            raise HandrailError(
                "evaluation: a worker was killed, perhaps for want of memory; what was done is kept, and the "
                "same command goes on; fewer --workers need less"
            ) from error
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
