"""The folder of a training run: settings, the last checkpoint, every evaluated actor.

Stable-Baselines3's own loader unpickles what it finds, and so runs the code of whoever wrote it. A checkpoint
is one file of tensors and numbers, and nothing else is read of it.
"""

import math
import re
import shutil
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast

import torch
from stable_baselines3 import SAC

from handrail.controllers.errors import HandrailError, message_of, shown
from handrail.controllers.regular_file import open_regular
from handrail.controllers.typed import NonNegative, check, decoded
from handrail.datasets.storage.atomic import publish_folder
from handrail.datasets.storage.strict_json import load_json, write_json
from handrail.policies.imitation.interface.trust import check_links
from handrail.policies.rl.policy import Actor
from handrail.scripts.bench.rl.config import TrainRlConfig

Curve = list[dict[str, float]]
SHOWN = {
    "success": "share of goals reached",
    "arm_effort": "arm effort Σ‖q̇‖² [rad²/s²]",
    "jerkiness": "jerkiness [m/s², rad/s²]",
}
"""What the figure of a curve shows."""
_STATE = "state.pt"
_ARRAYS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
_UNTIL = {"steps", "updates", "seconds"}  # what the last row of the curve has, of an interrupted run
_ROW = {*_UNTIL, *SHOWN}  # and every other one
_STEPS = re.compile(r"\d{8}", re.ASCII)  # name of a checkpoint


def begin_run(config: TrainRlConfig) -> None:
    """Make the folder of a new run and write its settings."""
    folder = config.folder
    if folder.exists() and any(folder.iterdir()):
        raise HandrailError(f"{folder}: there is something already; expected another folder, or --resume")
    folder.mkdir(parents=True, exist_ok=True)
    write_json(folder / "config.json", asdict(config))


def check_resumes(config: TrainRlConfig) -> Path:
    """Return the last checkpoint of a run that goes on with these settings."""
    last = _last(config.folder, "--resume")
    path = config.folder / "config.json"
    earlier = decoded(load_json(path, "settings of a training run"), TrainRlConfig, repr(str(path)))
    config.check_continues(earlier)
    return last


def resume_run(last: Path, model: SAC) -> tuple[Curve, float]:
    """Give a model all that a checkpoint has, transitions too; return the curve and the time [s] until then.

    Args:
        last: checkpoint of the run.
        model: untrained, with the same settings.
    """
    state, buffer = _state(last), model.replay_buffer
    assert buffer is not None
    curve = _curve(state, last)
    try:
        model.set_parameters(state["networks"], exact_match=True, device="cpu")
        with torch.no_grad():
            cast(torch.Tensor, model.log_ent_coef).copy_(state["temperature"])
        buffer.pos, buffer.full = state["place"]
        for name in _ARRAYS:
            values, target = state["transitions"][name].numpy(), getattr(buffer, name)[: buffer.size()]
            if values.shape != target.shape or buffer.pos not in range(buffer.buffer_size):
                raise ValueError(f"{name} of shape {values.shape}, next to be written {buffer.pos}")
            target[...] = values
    except Exception as error:  # of PyTorch: whatever the tensors are, they do not fit
        raise _broken(last, error) from error
    model.num_timesteps, model._n_updates = int(last.name), int(curve[-1]["updates"])
    evaluated = [row for row in curve if row.keys() >= _ROW]
    return evaluated, curve[-1]["seconds"]


def start_from(folder: Path, model: SAC) -> None:
    """Give a model the actor and critics of a run's last checkpoint, not the optimisers' memory."""
    last = _last(folder, "--start_from")
    state = _state(last)
    try:
        model.policy.load_state_dict(state["networks"]["policy"])
    except Exception as error:  # of PyTorch: whatever the tensors are, they do not fit
        raise _broken(last, error) from error


def write_checkpoint(folder: Path, model: SAC, actor: Actor | None, curve: Curve) -> None:
    """Write a checkpoint under another name, rename it, and remove the one before.

    Args:
        folder: of the run.
        model: in training.
        actor: of the model, if it was evaluated.
        curve: until now; the last row says how far the training is.
    """
    name = f"{model.num_timesteps:08d}"
    if actor is not None:
        (folder / "actors").mkdir(exist_ok=True)
        actor.save(folder / "actors" / f"{name}.npz")
    earlier, final = _checkpoints(folder), folder / "checkpoints" / name
    partial = final.with_suffix(".partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    buffer = model.replay_buffer
    assert buffer is not None
    arrays = {name: torch.from_numpy(getattr(buffer, name)[: buffer.size()].copy()) for name in _ARRAYS}
    state = {"networks": model.get_parameters(), "temperature": model.log_ent_coef, "curve": curve}
    torch.save(state | {"place": [buffer.pos, buffer.full], "transitions": arrays}, partial / _STATE)
    publish_folder(partial, final)
    for path in earlier[-1:]:
        shutil.rmtree(path)


def evaluated_actors(folder: Path, most: int) -> list[Actor]:
    """Return the last evaluated actors of a run, at most so many."""
    return [Actor.load(path) for path in sorted((folder / "actors").glob("*.npz"))[-most:]]


def _checkpoints(folder: Path) -> list[Path]:
    return sorted(path for path in (folder / "checkpoints").glob("*") if _STEPS.fullmatch(path.name))


def _last(folder: Path, flag: str) -> Path:
    """Return the last checkpoint of somebody's run."""
    found = _checkpoints(folder)
    if not found:
        raise HandrailError(f"{flag}: expected a run with a checkpoint in {folder}, found none")
    check_links(found[-1])
    return found[-1]


def _state(folder: Path) -> Mapping[str, Any]:
    """Return tensors and numbers of a checkpoint."""
    try:
        with open_regular(folder / _STATE) as file:
            state = torch.load(file, weights_only=True, map_location="cpu")
    except Exception as error:  # of zipfile, pickle and PyTorch: whatever the file holds, it is refused
        raise _broken(folder, error) from error
    if not isinstance(state, Mapping) or not _is_finite(state):
        raise _broken(folder, "something else, NaN or infinity")
    return state


def _is_finite(content: Any) -> bool:
    """Return whether every number in nested dictionaries and lists is finite."""
    if isinstance(content, torch.Tensor):
        return bool(content.isfinite().all())
    if isinstance(content, float):
        return math.isfinite(content)
    inside = content.values() if isinstance(content, Mapping) else content
    return all(map(_is_finite, inside)) if isinstance(content, Mapping | list | tuple) else True


def _curve(state: Mapping[str, Any], last: Path) -> Curve:
    where = f"{str(last / _STATE)!r}: expected the curve of a training run until step {int(last.name)}"
    rows = check(state.get("curve"), list[dict[str, NonNegative]], where)
    whole = all(row.keys() >= _ROW for row in rows[:-1]) and all(row.keys() >= _UNTIL for row in rows[-1:])
    if not rows or not whole or rows[-1]["steps"] != int(last.name):
        raise HandrailError(f"{where}, got {shown(rows)}")
    return rows


def _broken(folder: Path, reason: str | Exception) -> HandrailError:
    found = reason if isinstance(reason, str) else message_of(reason)
    return HandrailError(f"{str(folder / _STATE)!r}: expected a checkpoint of this run, got {found}")
