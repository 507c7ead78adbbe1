"""Training of an imitation policy: a part of a dataset, through an interface, with LeRobot's own parts."""

import logging
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast

from lerobot.configs.default import DatasetConfig
from lerobot.configs.train import TrainPipelineConfig
from lerobot.optim.schedulers import CosineAnnealingWithWarmupSchedulerConfig as Cosine

from handrail.collect.session.build import build_task
from handrail.collect.session.recorded import COLUMN, recorded_settings
from handrail.controllers.errors import HandrailError
from handrail.controllers.versions import TRAINING, versions
from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.interface.checkpoint import (
    MODEL,
    PolicyMeta,
    TrainingSizes,
    last_checkpoint,
    origin_of,
    read_meta,
    write_meta,
)
from handrail.policies.imitation.interface.completion import Completion
from handrail.policies.imitation.interface.torch_state import threads
from handrail.policies.imitation.interface.trust import check_links, check_policy_folder
from handrail.policies.imitation.training.curve import NAME as CURVE
from handrail.policies.imitation.training.plateau import Plateau
from handrail.policies.imitation.training.presets import policy_config, resolved
from handrail.policies.imitation.training.refusal import in_one_line
from handrail.policies.imitation.training.resume import as_json, check_data, check_settings
from handrail.policies.imitation.training.run import TrainingRun
from handrail.policies.imitation.training.source import TrainingSource, read_source
from handrail.policies.imitation.training.validation import Validation

_LOG_EVERY = 50  # updates
_WARMUP = 500  # updates in which the learning rate rises, or a tenth of all if that is fewer


def train(config: TrainConfig, quiet: bool = False) -> Path:
    """Train, or go on training, and return the folder of the policy in the last checkpoint.

    Args:
        config: what to train on what.
        quiet: show no progress.
    """
    config.check()
    checkpoint = _begin(config)
    began = None if checkpoint is None else _goes_on(config, checkpoint)
    source, steps = read_source(config, began), resolved(config).steps
    if began is not None:
        check_data(source, began)
    losses = {int(step): loss for step, loss in began.validation.items()} if began else {}
    plateau = _plateau(config, steps, losses)
    if checkpoint is not None and int(checkpoint.name) >= (plateau.end if plateau else steps):
        return checkpoint / MODEL
    with threads(config.threads), _no_pages_of_logs(), in_one_line(config), _going_on(config):
        _run(config, source, steps, checkpoint, quiet, losses, plateau)
    last = last_checkpoint(config.folder)
    assert last is not None
    return last / MODEL


def _goes_on(config: TrainConfig, checkpoint: Path) -> PolicyMeta:
    """Return what a checkpoint says of itself, once it is sure to do no harm and to fit."""
    for folder in (checkpoint, checkpoint / "training_state"):
        check_links(folder)
    _, began = read_meta(checkpoint / MODEL)
    check_settings(config, began)
    check_policy_folder(checkpoint / MODEL, asked=[policy_config(config)])
    return began


def _plateau(config: TrainConfig, steps: int, losses: Mapping[int, float]) -> Plateau | None:
    """Return what ends a training where the loss on held-out episodes is flat; None where nothing does."""
    if not config.patience:
        return None
    return Plateau(losses, config.patience, config.improvement, steps, min(_WARMUP, steps // 10))


def _run(
    config: TrainConfig,
    source: TrainingSource,
    steps: int,
    checkpoint: Path | None,
    quiet: bool,
    losses: dict[int, float],
    plateau: Plateau | None,
) -> None:
    settings = _settings(config, steps)
    assert settings.policy is not None
    learnt, held_out = (source.only(rows).dataset(settings.policy) if rows else None for rows in source.split)
    assert learnt is not None
    task, mode, robot = origin_of(source.info, source.selection.rows)
    TrainingRun(
        settings,
        learnt,
        checkpoint,
        lambda folder, step: write_meta(folder, source.interface, _meta(source, step, losses)),
        quiet,
        source.interface,
        Completion(robot, task, mode, source.info.fps),
        Validation(held_out, config.eval_steps, losses) if held_out else None,
        plateau,
    ).train()


def _settings(config: TrainConfig, steps: int) -> TrainPipelineConfig:
    sizes, policy = resolved(config), policy_config(config)
    schedule = Cosine(min(_WARMUP, steps // 10)) if sizes.cosine else policy.get_scheduler_preset()
    return TrainPipelineConfig(
        dataset=DatasetConfig(config.dataset.name, root=str(config.dataset.folder), video_backend="pyav"),
        policy=policy,
        output_dir=config.folder,
        job_name=policy.type,
        seed=config.seed,
        num_workers=0,
        batch_size=sizes.batch_size,
        steps=steps,
        log_freq=_LOG_EVERY,
        save_freq=config.save_freq,
        env_eval_freq=0,
        optimizer=policy.get_optimizer_preset(),
        scheduler=None if config.patience else schedule,  # then the plateau says it
    )


def _begin(config: TrainConfig) -> Path | None:
    """Make room for a training; return the checkpoint that it goes on from, if any."""
    folder = config.folder
    if folder.exists() and not folder.is_dir():
        raise HandrailError(f"--output {config.output}: expected a folder, found a file")
    if config.resume or not folder.exists() or not _is_main_process():
        return last_checkpoint(folder) if config.resume else None
    foreign = _foreign(folder)
    if foreign:
        raise HandrailError(
            f"--output {config.output}: expected a missing or empty folder, found {', '.join(foreign[:3])};"
            " choose another"
        )
    if any(folder.iterdir()) and not config.overwrite:
        raise HandrailError(
            f"--output {config.output}: there is a training already; say --resume or --overwrite"
        )
    shutil.rmtree(folder)
    return None


def _foreign(folder: Path) -> list[str]:
    """Return what lies in a training's folder and is not the training's."""
    files = {CURVE, f".{CURVE}.partial", "training.json"}  # the last of an earlier version
    kept = [path for path in (folder / "checkpoints").glob("*") if not _is_checkpoint(path)]
    others = [path for path in folder.iterdir() if path.name not in files | {"checkpoints"}]
    return sorted(path.relative_to(folder).as_posix() for path in (*others, *kept))


def _is_checkpoint(path: Path) -> bool:
    return path.name in ("last", ".last") or path.name.strip(".").removesuffix(".old").isdecimal()


def _meta(source: TrainingSource, steps: int, losses: Mapping[int, float] | None = None) -> PolicyMeta:
    config, rows = source.config, source.selection.rows
    return PolicyMeta(
        *origin_of(source.info, rows),
        fps=source.info.fps,
        actions=config.actions,
        training_seed=config.seed,
        dataset_draw=config.draw,
        trained_on=source.trained_on,
        policy=config.policy,
        steps=steps,
        training=asdict(config),
        versions=versions(*TRAINING),
        sizes=cast(TrainingSizes, as_json(resolved(config))),
        episodes=tuple(int(row["episode_index"]) for row in rows),
        data=source.digest,
        time_limit=_time_limit(rows),
        validation={str(step): loss for step, loss in (losses or {}).items()},
    )


def _time_limit(rows: Sequence[Mapping[str, Any]]) -> float:
    """Return the longest time that episodes were given [s]; 0 for the task's own, or if one does not say."""
    try:
        settings = [recorded_settings(row) for row in {str(row.get(COLUMN)): row for row in rows}.values()]
        if not any(each.time_limit for each in settings):
            return 0.0
        return float(max(build_task(each).horizon for each in settings))
    except HandrailError:
        return 0.0


@contextmanager
def _going_on(config: TrainConfig) -> Iterator[None]:
    """Say what an interrupted training comes to."""
    try:
        yield
    except KeyboardInterrupt:
        last = last_checkpoint(config.folder)
        goes_on = f"--resume goes on after update {int(last.name)}" if last else "no update was made"
        raise KeyboardInterrupt(f"training: interrupted; {goes_on}") from None


def _is_main_process() -> bool:
    return os.environ.get("RANK", "0") == "0"


@contextmanager
def _no_pages_of_logs() -> Iterator[None]:
    """Keep to oneself what LeRobot says on its way, such as which decoders of videos it could not load."""
    before = logging.root.manager.disable
    logging.disable(logging.WARNING)
    try:
        yield
    finally:
        logging.disable(before)
