"""Evaluates trained policies: every checkpoint under every condition on the same declared seeds."""

import multiprocessing
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from time import monotonic
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.arms import arms
from handrail.policies.imitation.evaluate_config import EvaluateConfig
from handrail.policies.imitation.evaluation_file import EvaluationFile
from handrail.policies.imitation.operator import Policy
from handrail.policies.imitation.rollout import Load, Rollout, Row, run_rollout

_SAVE_EVERY = 2.0  # [s]


def load_trained(folder: Path) -> Policy:
    """Return the trained policy in a checkpoint folder."""
    from handrail.policies.imitation.checkpoint import load_policy

    return load_policy(folder)


def evaluate(
    config: EvaluateConfig, console: Console | None = None, load: Load = load_trained
) -> dict[str, Any]:
    """Run what is not in the file yet, write it, and return the content of the file.

    Every arm meets the same episodes and the same disturbances, and a rollout depends on nothing but its arm
    and seed: neither on the number of processes nor on what ran before.

    Args:
        config: what to run.
        console: for the progress bar; none without it.
        load: reads the policy of a checkpoint folder.

    Raises:
        HandrailError: a setting or a checkpoint is wrong, or the file cannot be written.
    """
    config.check()
    found = arms(config)
    file = EvaluationFile(config.file if config.json else None)
    file.open(found)
    rollouts = [Rollout(arm, seed) for arm in found for seed in config.seeds if seed not in file.done(arm)]
    try:
        _run_all(rollouts, config.workers, load, file, console or Console(quiet=True))
    finally:
        file.save()
    return file.content


def _run_all(
    rollouts: Sequence[Rollout], workers: int, load: Load, file: EvaluationFile, console: Console
) -> None:
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    saved, successes = monotonic(), 0
    with Progress(*columns, TextColumn("{task.fields[success]}"), console=console) as progress:
        bar = progress.add_task("rollouts", total=len(rollouts), success="")
        for count, (rollout, row) in enumerate(_results(rollouts, workers, load), start=1):
            file.add(rollout.arm, row)
            successes += row["success"]
            progress.update(bar, advance=1, success=f"{successes}/{count} succeeded")
            if monotonic() - saved > _SAVE_EVERY:
                file.save()
                saved = monotonic()


def _results(rollouts: Sequence[Rollout], workers: int, load: Load) -> Iterator[tuple[Rollout, Row]]:
    """Yield the rollouts as they are done, in any order."""
    if min(workers, len(rollouts)) <= 1:
        yield from ((rollout, run_rollout(rollout, load)) for rollout in rollouts)
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(workers, len(rollouts)), context) as pool:
        try:
            running = {pool.submit(run_rollout, rollout, load): rollout for rollout in rollouts}
            for done in as_completed(running):
                yield running[done], done.result()
        except BrokenProcessPool as error:
            raise HandrailError(
                "evaluation: a worker was killed, perhaps for want of memory; what was done is kept, and the "
                "same command goes on; fewer --workers need less"
            ) from error
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
