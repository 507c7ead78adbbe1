"""Evaluates trained policies: every checkpoint under every condition on the same declared seeds."""

import multiprocessing
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from time import monotonic
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.evaluation.conditions import arms
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.file import EvaluationFile
from handrail.policies.imitation.evaluation.operator import Policy
from handrail.policies.imitation.evaluation.rollout import Load, Rollout, Row, run_rollout

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


def load_trained(folder: Path) -> Policy:
    """Return the trained policy in a checkpoint folder."""
    from handrail.policies.imitation.interface.checkpoint import load_policy

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
        UnevaluatedError: some policies could not be evaluated, the others were.
        HandrailError: a setting is wrong, no policy could be evaluated, or the file cannot be written.
    """
    config.check()
    refused: list[str] = []
    found = arms(config, refused)
    file = EvaluationFile(config.file if config.json else None)
    file.open(found)
    rollouts = [Rollout(arm, seed) for arm in found for seed in config.seeds if seed not in file.done(arm)]
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
        for count, (rollout, row) in enumerate(_results(rollouts, workers, load, refused), start=1):
            file.add(rollout.arm, row)
            successes += row["success"]
            progress.update(bar, advance=1, success=f"{successes}/{count} succeeded")
            if monotonic() - saved > _SAVE_EVERY:
                file.save()
                saved = monotonic()
    return list(refused.values())


def _results(
    rollouts: Sequence[Rollout], workers: int, load: Load, refused: dict[Path, str]
) -> Iterator[tuple[Rollout, Row]]:
    """Yield the rollouts as they are done, in any order; note policies that cannot be run."""
    tried = _here(rollouts, load, refused) if min(workers, len(rollouts)) <= 1 else None
    for rollout, row in tried or _in_processes(rollouts, workers, load, refused):
        if isinstance(row, HandrailError):
            refused.setdefault(rollout.arm.checkpoint.folder, str(row))
        else:
            yield rollout, row


def _try(rollout: Rollout, load: Load) -> Row | HandrailError:
    """Return how a rollout went, or why it could not be run."""
    try:
        return run_rollout(rollout, load)
    except HandrailError as error:
        return HandrailError(str(error))


def _here(
    rollouts: Sequence[Rollout], load: Load, refused: dict[Path, str]
) -> Iterator[tuple[Rollout, Row | HandrailError]]:
    for rollout in rollouts:
        if rollout.arm.checkpoint.folder not in refused:
            yield rollout, _try(rollout, load)


def _in_processes(
    rollouts: Sequence[Rollout], workers: int, load: Load, refused: dict[Path, str]
) -> Iterator[tuple[Rollout, Row | HandrailError]]:
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(workers, len(rollouts)), context) as pool:
        try:
            running = {pool.submit(_try, rollout, load): rollout for rollout in rollouts}
            for done in as_completed(running):
                if not done.cancelled():
                    yield running[done], done.result()
                _cancel(running, refused)
        except BrokenProcessPool as error:
            raise HandrailError(
                "evaluation: a worker was killed, perhaps for want of memory; what was done is kept, and the "
                "same command goes on; fewer --workers need less"
            ) from error
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _cancel(running: Mapping[Future[Any], Rollout], refused: Mapping[Path, str]) -> None:
    """Do not begin what is left of policies that cannot be run."""
    for future, rollout in running.items() if refused else ():
        if rollout.arm.checkpoint.folder in refused:
            future.cancel()
