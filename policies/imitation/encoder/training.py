"""Trains an encoder on scenes that are drawn meanwhile; measures it on others."""

import math
import signal
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import asdict
from io import BytesIO
from typing import Any

import numpy as np
import torch
from rich.table import Table
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn
from torch.utils.data import DataLoader

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError, restated
from handrail.controllers.interrupts import Interrupts
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.atomic import beside, explained, write_whole
from handrail.datasets.storage.lock import FolderLock
from handrail.policies.imitation.encoder.config import EncoderConfig
from handrail.policies.imitation.encoder.samples import DRIVEN, START, Drawn, Samples, batches
from handrail.policies.imitation.interface.compute import device_of, threads
from handrail.policies.imitation.interface.encoder import Encoder, same
from handrail.policies.imitation.interface.relative import POSE, rotations
from handrail.policies.imitation.interface.scene_memory import SceneMemory
from handrail.policies.imitation.interface.views import PLACED, facing, in_picture, placed

_KEPT = 2e9  # of samples to draw from [byte]
_WARMUP = 200  # updates
_FALL = 0.6  # share of the updates from which on the learning rate falls, along a cosine
_AVERAGED = 0.998  # of the weights, an update
_MEASURED = 2**31  # number of the first chunk that is only measured on
_CHUNKS = 4
_SAVED = 200  # updates
_LOOK = 0.3  # how much it counts where an eye looks


def train(config: EncoderConfig) -> None:
    """Train an encoder, or go on with it, and print how far off it is."""
    config.check()
    lock = FolderLock(beside(config.file.resolve(), "lock"), f"--output {config.output}", "handrail-encoder")
    with lock, threads(config.threads), Interrupts() as interrupts, interrupts.deferred():
        training = _Training(config)
        console = Terminal(stderr=True)
        for update in training.updates():
            if update % _SAVED == 0 or interrupts.asked or update == config.updates:
                training.save()
                console.print(f"update {update} of {config.updates}: loss {training.loss:.3f}")
            if interrupts.asked:
                raise KeyboardInterrupt
        encoder = training.encoder
        encoder.save(config.file)
    measured = Encoder.load(config.file)
    Terminal().print(error_table(errors(measured, _chunks(config, _MEASURED, _MEASURED + _CHUNKS))))
    Terminal().print(f"written: {config.output}")


def errors(encoder: Encoder, chunks: Iterator[Samples]) -> dict[str, dict[str, FloatArray]]:
    """Return how far off an encoder is, by object and quantity, at starts and on the way; without memory.

    `START` and `DRIVEN` moments alone: the others are for learning.
    """
    found: dict[str, dict[str, list[FloatArray]]] = {}
    for chunk in chunks:
        told = _without_memory(encoder, chunk)
        for name, parts, start in encoder.reads.objects:
            truth, said = (each[:, start : start + len(parts)] for each in (chunk["environment"], told))
            off = {"position": np.linalg.norm(said[:, :3] - truth[:, :3], axis=1)}
            if parts == POSE:
                apart = same(encoder.reads.turns.get(name, 1))
                ways = np.einsum("tij,kjl->ktil", rotations(truth[:, 3:]), apart)
                trace = np.einsum("ktij,tij->kt", ways, rotations(said[:, 3:])).max(0)
                off["rotation"] = np.degrees(np.arccos(np.clip((trace - 1) / 2, -1, 1)))
            for moment, kind in (("start", START), ("under way", DRIVEN)):
                for what, values in off.items():
                    rows = found.setdefault(name, {}).setdefault(f"{what} {moment}", [])
                    rows.append(values[chunk["kind"] == kind])
    return {name: {what: np.concatenate(each) for what, each in of.items()} for name, of in found.items()}


def _without_memory(encoder: Encoder, chunk: Samples) -> FloatArray:
    """Return the environment's state as each moment alone says it, (T, e)."""
    pictures = (
        {name: chunk[name][[row]] for name in encoder.reads.cameras} for row in range(len(chunk["kind"]))
    )
    said = encoder.said(np.concatenate([encoder.read(each) for each in pictures]), chunk["state"])
    return np.stack([SceneMemory(encoder.reads).take(said, row) for row in range(len(chunk["kind"]))])


def error_table(found: Mapping[str, Mapping[str, FloatArray]]) -> Table:
    """Return how far off an encoder is as a table."""
    table = Table("object", "", "median", "90 %", "moments", title="How far off, on scenes of its own")
    for name, quantities in found.items():
        for what, values in quantities.items():
            unit, factor = ("°", 1.0) if what.startswith("rotation") else (" cm", 100.0)
            numbers = [f"{factor * np.quantile(values, share):.1f}{unit}" for share in (0.5, 0.9)]
            table.add_row(name, what, *numbers, str(len(values)))
    return table


class _Training:
    """A training, new or begun.

    Attributes:
        loss: of lately.
    """

    def __init__(self, config: EncoderConfig) -> None:
        self._config = config
        drawn = Drawn(config)
        torch.manual_seed(config.seed)
        self._encoder = Encoder(drawn.reads)
        network = self._encoder.network.to(device_of(config.device))
        self._averaged = AveragedModel(network, multi_avg_fn=get_ema_multi_avg_fn(_AVERAGED))
        self._optimizer = torch.optim.AdamW(network.parameters(), config.lr, weight_decay=1e-4, fused=True)
        self._draft = config.file.with_suffix(".training")
        self._update, self._chunk, self.loss = 0, 0, math.nan
        if config.overwrite:
            self._draft.unlink(missing_ok=True)
        if self._draft.is_file():
            self._load()
        elif config.file.exists() and not config.overwrite:
            raise HandrailError(f"{str(config.file)!r}: no {self._draft.name} to go on from; say --overwrite")

    @property
    def encoder(self) -> Encoder:
        """The encoder with the weights' average of lately."""
        network: Any = deepcopy(self._averaged.module)
        return Encoder(self._encoder.reads, network.cpu())

    def updates(self) -> Iterator[int]:
        """Make every update that is left, and yield its number."""
        config, network = self._config, self._encoder.network
        size = sum(3 * h * w for h, w in self._encoder.reads.pictures.values())
        drawn = self._counted(_chunks(config, self._chunk, 2**30))
        samples = batches(drawn, config.batch_size, config.reuse, round(_KEPT / size), config.seed)
        rng = np.random.default_rng([config.seed, self._chunk, 1])
        while self._update < config.updates:
            batch = next(samples)
            for group in self._optimizer.param_groups:
                group["lr"] = config.lr * _rate(self._update, config.updates)
            network.train()
            loss = _loss(self._encoder, batch, rng)
            self._optimizer.zero_grad(set_to_none=True)
            loss.backward()
            nn.utils.clip_grad_norm_(network.parameters(), 10.0)
            self._optimizer.step()
            self._averaged.update_parameters(network)
            self._update += 1
            self.loss = 0.98 * self.loss + 0.02 * loss.item() if math.isfinite(self.loss) else loss.item()
            if not math.isfinite(self.loss):
                raise HandrailError(f"encoder: expected a finite loss, got {self.loss} at {self._update}")
            yield self._update

    def _counted(self, chunks: Iterator[Samples]) -> Iterator[Samples]:
        for chunk in chunks:
            self._chunk += 1
            yield chunk

    def save(self) -> None:
        """Keep where the training stands."""
        content = {"settings": self._settings, "at": (self._update, self._chunk)}
        data = BytesIO()
        torch.save(content | {"parts": [part.state_dict() for part in self._parts]}, data)
        with explained(f"cannot write {str(self._draft)!r}"):
            write_whole(self._draft, data.getvalue())

    def _load(self) -> None:
        with restated(f"{str(self._draft)!r}: say --overwrite"):  # of PyTorch, whatever the file holds
            content = torch.load(self._draft, self._config.device, weights_only=True)
            if content["settings"] != self._settings:
                raise HandrailError("was begun with other settings")
            for part, state in zip(self._parts, content["parts"], strict=True):
                part.load_state_dict(state)
            self._update, self._chunk = content["at"]

    @property
    def _parts(self) -> tuple[Any, ...]:
        """All that learns, or that remembers what was learnt."""
        return self._encoder.network, self._averaged, self._optimizer

    @property
    def _settings(self) -> dict[str, Any]:
        free = ("output", "updates", "device", "workers", "threads", "overwrite")
        return {name: value for name, value in asdict(self._config).items() if name not in free}


def _chunks(config: EncoderConfig, first: int, end: int) -> Iterator[Samples]:
    """Yield chunks in order, however many processes draw them: without a copy, as tensors."""
    around: dict[str, Any] = {"multiprocessing_context": "spawn", "worker_init_fn": _undisturbed}
    loader = DataLoader(
        Drawn(config),  # pyright: ignore[reportArgumentType]
        batch_size=None,
        sampler=range(first, end),
        num_workers=config.workers,
        **(around if config.workers else {}),  # spawned: they end with the training, however it ends
    )
    return ({name: each.numpy() for name, each in chunk.items()} for chunk in loader)


def _undisturbed(worker: int) -> None:
    """Leave Ctrl-C to the training, which saves and then ends the workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _rate(update: int, updates: int) -> float:
    """Return the share of the highest learning rate at an update."""
    fallen = max(0.0, (update / updates - _FALL) / (1.0 - _FALL))
    return min(1.0, (update + 1) / _WARMUP) * max(0.01, 0.5 * (1.0 + math.cos(math.pi * fallen)))


def _loss(encoder: Encoder, batch: Samples, rng: np.random.Generator) -> Tensor:
    """Return −log p of where the objects are and how they are turned, the mean over a batch.

    Summed over cameras and objects; `p ∝ e^(−m)` with `m² = e_l² / σ_l² + e_d² / σ_d²`, `m = ‖e_M‖ / b`;
    and `p = w`, what an eye looks at, of where they are in a picture.
    """
    device = next(encoder.network.parameters()).device
    pictures = {name: _disturbed(batch[name], rng, device) for name in encoder.reads.cameras}
    looked, loss = encoder.network.look(pictures), torch.zeros(())
    views = zip(encoder.reads.cameras.values(), looked, batch["views"].swapaxes(0, 1), strict=True)
    for camera, (said, heat), view in views:
        turn, slope = view[:, 3:12].reshape(-1, 3, 3), torch.from_numpy(view[:, 12]).float()
        parts = said.cpu().split(encoder.reads.sizes, 1), heat.cpu().unbind(1)
        for (name, quantities, first), each, warm in zip(encoder.reads.objects, *parts, strict=True):
            truth = batch["environment"][:, first : first + len(quantities)].astype(float)
            place, ray, width = placed(each, slope, camera.size)
            there = torch.from_numpy(np.einsum("tji,tj->ti", turn, truth[:, :3] - view[:, :3])).float()
            loss = loss + _LOOK * _missed(warm, in_picture(there, slope, camera.size))
            off = place - there
            along = (off * ray).sum(1)
            across = (off - along[:, None] * ray).norm(dim=1)
            far = torch.stack([across, along], 1) / width.exp()
            loss = loss + _surprise(far.norm(dim=1), width @ torch.tensor([2.0, 1.0]))
            if quantities == POSE:
                axes = (turn @ facing(there.numpy())).swapaxes(1, 2)
                ways = _ways(axes @ rotations(truth[:, 3:]), encoder.reads.turns.get(name, 1))
                b = each[:, -1].clamp(-6.0, 3.0)
                loss = loss + _surprise((each[:, PLACED:-1] - ways).norm(dim=2).amin(0) / b.exp(), 3.0 * b)
    return loss


def _missed(warm: Tensor, place: Tensor) -> Tensor:
    """Return −log w at places of pictures, the mean over a batch; 0 where they are beside.

    Args:
        warm: log w, (T, h, w).
        place: u, v, (T, 2).
    """
    inside = (place.abs() <= 1.0).all(1)
    at = torch.where(inside[:, None], place, 0.0)[:, None, None]
    found = nn.functional.grid_sample(warm[:, None], at, align_corners=False)
    return -(found.flatten() * inside).mean()


def _ways(turned: FloatArray, turns: int) -> Tensor:
    """Return M in all ways that look the same, (k, T, 6)."""
    ways = np.einsum("tij,kjl->ktil", turned, same(turns))[..., :2]
    return torch.from_numpy(ways.swapaxes(2, 3).reshape(*ways.shape[:2], 6)).float()


def _surprise(far: Tensor, volume: Tensor) -> Tensor:
    """Return the mean of `m + log σ³`; what is known badly counts less, by √σ."""
    return ((far + volume) * (volume.detach() / 6.0).exp()).mean()


def _disturbed(pictures: np.ndarray, rng: np.random.Generator, device: torch.device) -> Tensor:
    """Return pictures from 0 to 1, (B, 3, height, width), brighter or darker."""
    shape = (len(pictures), 1, 1, 1)
    gain, lift = rng.uniform(0.8, 1.2, shape) / 255.0, rng.uniform(-0.1, 0.1, shape)
    given = torch.from_numpy(pictures).to(device)
    numbers = given.movedim(-1, 1).to(torch.float32, memory_format=torch.contiguous_format)
    gains, lifts = (torch.from_numpy(each).float().to(device) for each in (gain, lift))
    return numbers.mul_(gains).add_(lifts).clamp_(0, 1)
