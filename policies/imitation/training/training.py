"""Training of an imitation policy: a part of a dataset, through an interface, with LeRobot's own parts."""

import logging
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, replace
from pathlib import Path

from lerobot.configs.default import DatasetConfig
from lerobot.configs.train import TrainPipelineConfig
from lerobot.optim.schedulers import CosineAnnealingWithWarmupSchedulerConfig as Cosine

from handrail.controllers.errors import HandrailError, restated
from handrail.controllers.typed import decoded
from handrail.controllers.versions import TRAINING, versions
from handrail.datasets.storage.atomic import beside, remove
from handrail.datasets.storage.lock import FolderLock
from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.interface.checkpoint import MODEL, PolicyMeta, last_checkpoint, read_meta
from handrail.policies.imitation.interface.compute import threads
from handrail.policies.imitation.interface.origin import origin_of
from handrail.policies.imitation.interface.trust import check_links, check_policy_folder
from handrail.policies.imitation.training.curve import NAME as CURVE
from handrail.policies.imitation.training.earlier import earlier_policy
from handrail.policies.imitation.training.presets import check_settings, in_one_line, policy_config, resolved
from handrail.policies.imitation.training.run import TrainingRun
from handrail.policies.imitation.training.source import TrainingSource, read_source

_MAIN = os.environ.get("RANK", "0") == "0"  # the one of several processes that makes room and writes
_LOG_EVERY = 50  # updates
_WARMUP = 500  # updates in which the learning rate rises, or a tenth of all if that is fewer
_OURS = {CURVE, f".{CURVE}.partial", "checkpoints"}


def train(config: TrainConfig) -> Path:
    """Train, or go on training, and return the folder of the policy in the last checkpoint.

    Args:
        config: what to train on what.
    """
    config.check()
    lock, output = beside(Path(os.path.realpath(config.folder)), "lock"), f"--output {config.output}"
    with in_one_line(config), FolderLock(lock, output, "handrail-train") if _MAIN else nullcontext():
        checkpoint = _begin(config)
        began = None if checkpoint is None else _checked(config, checkpoint)
        config = replace(config, steps=config.steps or began.sizes.steps) if began else config
        weights, known = checkpoint and checkpoint / MODEL, began
        if config.init and checkpoint is None:
            weights, known = earlier_policy(config)
        source = read_source(config, began, known if config.init else None)
        steps = resolved(config).steps
        losses = {int(step): loss for step, loss in began.validation.items()} if began else {}
        decoded(asdict(_meta(source, steps, losses)), PolicyMeta, f"dataset {str(source.info.root)!r}")
        if checkpoint is None or int(checkpoint.name) < steps:
            with threads(config.threads), _quiet(config):
                settings = _settings(config, steps)
                assert settings.policy is not None
                learning, held_out = source.split
                learnt, out = source.only(learning).dataset(settings.policy), None
                if held_out:
                    with restated(f"--eval_split, as --draw {config.draw} holds out", HandrailError):
                        out = source.only(held_out).dataset(settings.policy)
                training = TrainingRun(settings, learnt, checkpoint, weights, source.encoder)
                for path in config.folder.glob("*") if config.overwrite and _MAIN else ():
                    remove(path)  # not before all else is sure
                measured = out, losses, config.eval_steps
                training.train(lambda step: _meta(source, step, losses), *measured)
            checkpoint = last_checkpoint(config.folder)
        assert checkpoint is not None
        return checkpoint / MODEL


def _checked(config: TrainConfig, checkpoint: Path) -> PolicyMeta:
    """Return what a checkpoint says of itself, once it is sure to do no harm and to fit."""
    for folder in (checkpoint, checkpoint / "training_state"):
        check_links(folder)
    began = read_meta(checkpoint / MODEL)
    check_settings(config, began)
    check_policy_folder(checkpoint / MODEL, asked=[policy_config(config)])
    return began


def _settings(config: TrainConfig, steps: int) -> TrainPipelineConfig:
    sizes, policy = resolved(config), policy_config(config)
    warmed = Cosine(min(_WARMUP, steps // 10))
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
        scheduler=warmed if sizes.cosine else policy.get_scheduler_preset(),
    )


def _begin(config: TrainConfig) -> Path | None:
    """Check that a training has room; return the checkpoint that it goes on from, if any."""
    folder, where = config.folder, f"--output {config.output}"
    if folder.exists() and not folder.is_dir():
        raise HandrailError(f"{where}: expected a folder, found a file")
    if config.resume and (last := last_checkpoint(folder)):
        return last
    if not folder.exists() or not _MAIN:
        return None
    kept = [path for path in (folder / "checkpoints").glob("*") if not _is_checkpoint(path)]
    others = [path for path in folder.iterdir() if path.name not in _OURS]
    if foreign := sorted(path.relative_to(folder).as_posix() for path in (*others, *kept)):
        raise HandrailError(f"{where}: expected a missing or empty folder, found {', '.join(foreign[:3])}")
    if any(folder.iterdir()) and not (config.overwrite or config.resume):
        raise HandrailError(f"{where}: there is a training already; say --resume or --overwrite")
    return None


def _is_checkpoint(path: Path) -> bool:
    return path.name in ("last", ".last") or path.name.strip(".").removesuffix(".replaced").isdecimal()


def _meta(source: TrainingSource, steps: int, losses: Mapping[int, float]) -> PolicyMeta:
    config, rows = source.config, source.selection.rows
    return PolicyMeta(
        source.interface,
        **origin_of(source.info, rows),
        fps=source.info.fps,
        actions=config.actions,
        training_seed=config.seed,
        dataset_draw=config.draw,
        trained_on=source.trained_on,
        policy=config.policy,
        steps=steps,
        training=asdict(config),
        versions=versions(*TRAINING),
        sizes=resolved(config),
        episodes=tuple(int(row["episode_index"]) for row in rows),
        data=source.digest,
        cameras=source.encoder.reads.pictures if source.encoder else {},
        validation={str(step): loss for step, loss in losses.items()},
    )


@contextmanager
def _quiet(config: TrainConfig) -> Iterator[None]:
    """Keep LeRobot's logs to oneself; print what an interrupted training comes to."""
    before = logging.root.manager.disable
    logging.disable(logging.WARNING)
    try:
        yield
    except KeyboardInterrupt:
        last = last_checkpoint(config.folder)
        goes_on = f"--resume goes on after update {int(last.name)}" if last else "no update was made"
        raise KeyboardInterrupt(f"training: interrupted; {goes_on}") from None
    finally:
        logging.disable(before)
