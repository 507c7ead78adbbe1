"""The folder of a training run: settings, the last checkpoint, every evaluated actor.

Stable-Baselines3's own loader unpickles what it finds, and so runs the code of whoever wrote it. Only arrays
are read here: networks and optimisers from `model.zip`, transitions from `replay_buffer.npz`.
"""

import re
import shutil
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.save_util import load_from_zip_file

from handrail.controllers.errors import HandrailError, message_of, shown
from handrail.controllers.regular_file import open_regular, regular
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
_NETWORKS, _TRANSITIONS, _CURVE = "model.zip", "replay_buffer.npz", "curve.json"
_ARRAYS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
_UNTIL = {"steps", "updates", "seconds"}  # what the last row of the curve has, of an interrupted run
_ROW = {*_UNTIL, *SHOWN}  # and every other one
_STEPS = re.compile(r"\d{8}", re.ASCII)  # name of a checkpoint
_ENTROPY = "log_ent_coef"


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
    curve = _curve(last / _CURVE, int(last.name))
    parameters, variables = _tensors(last / _NETWORKS)
    try:
        model.set_parameters(dict(parameters), exact_match=True, device="cpu")
        with torch.no_grad():
            cast(torch.Tensor, model.log_ent_coef).copy_(variables[_ENTROPY])
    except Exception as error:  # of PyTorch: whatever the tensors are, they do not fit
        raise _broken(last / _NETWORKS, error) from error
    assert model.replay_buffer is not None
    _read_transitions(last / _TRANSITIONS, model.replay_buffer)
    model.num_timesteps, model._n_updates = int(last.name), int(curve[-1]["updates"])
    evaluated = [row for row in curve if row.keys() >= _ROW]
    return evaluated, curve[-1]["seconds"]


def start_from(folder: Path, model: SAC) -> None:
    """Give a model the actor and critics of a run's last checkpoint, not the optimisers' memory."""
    last = _last(folder, "--start_from")
    parameters, _ = _tensors(last / _NETWORKS)
    try:
        model.policy.load_state_dict(parameters["policy"])
    except Exception as error:  # of PyTorch: whatever the tensors are, they do not fit
        raise _broken(last / _NETWORKS, error) from error


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
    model.save(partial / _NETWORKS)
    buffer = model.replay_buffer
    assert buffer is not None
    arrays: dict[str, Any] = {name: getattr(buffer, name)[: buffer.size()] for name in _ARRAYS}
    np.savez(partial / _TRANSITIONS, place=np.array([buffer.pos, buffer.full]), **arrays)
    write_json(partial / _CURVE, curve)
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


def _tensors(path: Path) -> tuple[Mapping[str, Any], Mapping[str, torch.Tensor]]:
    """Return state dictionaries and single tensors of a model; what is pickled beside them is not read."""
    try:
        _, parameters, variables = load_from_zip_file(regular(path), load_data=False, device="cpu")
    except Exception as error:  # of zipfile, pickle and PyTorch: whatever the file holds, it is refused
        raise _broken(path, error) from error
    if not _is_finite([parameters, variables]):
        raise _broken(path, "NaN or infinity")
    return parameters, variables or {}


def _is_finite(content: Any) -> bool:
    """Return whether every tensor in nested state dictionaries is finite."""
    if isinstance(content, torch.Tensor):
        return bool(content.isfinite().all())
    inside = content.values() if isinstance(content, Mapping) else content
    return all(map(_is_finite, inside)) if isinstance(content, Mapping | list) else True


def _read_transitions(path: Path, buffer: ReplayBuffer) -> None:
    if not path.is_file():
        words = "found none; --start_from begins a new run with the networks of this one"
        raise HandrailError(f"{str(path)!r}: expected the transitions of a run, {words}")
    try:
        with open_regular(path) as file, np.load(file, allow_pickle=False) as arrays:
            place, full = map(int, arrays["place"])
            found = {name: arrays[name] for name in _ARRAYS}
    except Exception as error:  # of NumPy and zipfile: whatever the file holds, it is refused
        raise _broken(path, error) from error
    if not 0 <= place < buffer.buffer_size:
        raise _broken(path, f"place {place}")
    buffer.pos, buffer.full = place, bool(full)
    for name, values in found.items():
        target = getattr(buffer, name)[: buffer.size()]
        if values.shape != target.shape or values.dtype.kind not in "fi" or not np.isfinite(values).all():
            raise _broken(path, f"{name} of shape {values.shape}, numbers or not, finite or not")
        target[...] = values


def _curve(path: Path, steps: int) -> Curve:
    """Return the curve of a checkpoint after so many steps."""
    what = "the curve of a training run"
    where = f"{str(path)!r}: expected {what} until step {steps}"
    rows = check(load_json(path, what), list[dict[str, NonNegative]], where)
    whole = all(row.keys() >= _ROW for row in rows[:-1]) and all(row.keys() >= _UNTIL for row in rows[-1:])
    if not rows or not whole or rows[-1]["steps"] != steps:
        raise HandrailError(f"{where}, got {shown(rows)}")
    return rows


def _broken(path: Path, reason: str | Exception) -> HandrailError:
    found = reason if isinstance(reason, str) else message_of(reason)
    return HandrailError(f"{str(path)!r}: expected a checkpoint of this run, got {found}")
