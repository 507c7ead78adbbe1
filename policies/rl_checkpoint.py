"""The folder of a training run: settings, the last checkpoint, every evaluated actor."""

import json
import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Any

from stable_baselines3 import SAC

from handrail.controllers.errors import HandrailError
from handrail.datasets.atomic import publish_folder, write_whole
from handrail.policies.rl_config import TrainRlConfig
from handrail.policies.rl_policy import Actor

Curve = list[dict[str, float]]
_WRITTEN = ("config.json", "actor.json", "actor.npz", "curve.png")
_OURS = {*_WRITTEN, *(f".{name}.partial" for name in _WRITTEN), "checkpoints", "actors", "tensorboard"}


def begin_run(config: TrainRlConfig) -> None:
    """Make the folder of a new run and write its settings.

    Raises:
        HandrailError: something is there that must not be removed.
    """
    folder, settings = config.folder, config.folder / "config.json"
    if folder.exists() and any(folder.iterdir()):
        if not config.overwrite:
            raise HandrailError(f"{folder}: there is something already; expected --resume or --overwrite")
        foreign = sorted(path.name for path in folder.iterdir() if path.name not in _OURS)
        if foreign or not settings.is_file():
            found = ", ".join(foreign[:3]) or "something else"
            raise HandrailError(f"--overwrite: expected only a training run in {folder}, found {found}")
        shutil.rmtree(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(settings, (json.dumps(asdict(config), indent=1) + "\n").encode())


def resume_run(config: TrainRlConfig) -> tuple[SAC, Curve]:
    """Return the model of the last checkpoint, replay buffer included, and the curve until then.

    Raises:
        HandrailError: there is no checkpoint, or the settings differ from those that the run began with.
    """
    last = _last(config.folder)
    if last is None:
        raise HandrailError(f"--resume: expected a run with a checkpoint in {config.folder}, found none")
    settings = json.loads((config.folder / "config.json").read_text())
    config.check_continues(TrainRlConfig(**{**settings, "layers": tuple(settings["layers"])}))
    model = SAC.load(last / "model.zip", device="cpu")
    model.load_replay_buffer(last / "replay_buffer.pkl")
    return model, json.loads((last / "curve.json").read_text())


def last_networks(folder: Path) -> dict[str, Any]:
    """Return actor, critics and target critics of a run's last checkpoint, without the optimisers' memory.

    Raises:
        HandrailError: there is no checkpoint.
    """
    last = _last(folder)
    if last is None:
        raise HandrailError(f"--start_from: expected a run with a checkpoint in {folder}, found none")
    return SAC.load(last / "model.zip", device="cpu").policy.state_dict()


def write_checkpoint(folder: Path, model: SAC, actor: Actor, curve: Curve) -> None:
    """Write a checkpoint under another name, rename it, and remove the one before."""
    name = f"{model.num_timesteps:08d}"
    (folder / "actors").mkdir(exist_ok=True)
    actor.save(folder / "actors" / f"{name}.npz")
    last, final = _last(folder), folder / "checkpoints" / name
    partial = final.with_suffix(".partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    model.save(partial / "model.zip")
    model.save_replay_buffer(partial / "replay_buffer.pkl")
    write_whole(partial / "curve.json", (json.dumps(curve, indent=1) + "\n").encode())
    publish_folder(partial, final)
    if last is not None:
        shutil.rmtree(last)


def evaluated_actors(folder: Path, most: int) -> list[Actor]:
    """Return the last evaluated actors of a run, at most so many."""
    return [Actor.load(path) for path in sorted((folder / "actors").glob("*.npz"))[-most:]]


def _last(folder: Path) -> Path | None:
    found = sorted(path for path in (folder / "checkpoints").glob("*") if path.suffix != ".partial")
    return found[-1] if found else None
