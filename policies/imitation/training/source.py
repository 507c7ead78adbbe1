"""From a recorded dataset to what a policy is trained on: chosen episodes, seen through its interface."""

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Literal

import numpy as np
import torch

from handrail.collect.operators.modes import MODES
from handrail.controllers.errors import HandrailError
from handrail.datasets.format.data_file import data_files
from handrail.datasets.format.schema import POLICY_PREFIXES, Feature
from handrail.datasets.format.stats import column_stats
from handrail.datasets.reading.check import check_whole
from handrail.datasets.reading.digest import digest_of_pictures
from handrail.datasets.reading.reader import DatasetInfo, read_episodes, read_info, read_rows_of, with_success
from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.interface.checkpoint import PolicyMeta
from handrail.policies.imitation.interface.encoder import Encoder, find_encoder
from handrail.policies.imitation.interface.interface import (
    ACTION,
    COLUMNS,
    ENVIRONMENT,
    MASK,
    STATE,
    PolicyInterface,
)
from handrail.policies.imitation.training.corrections import Draws, corrected
from handrail.policies.imitation.training.earlier import same_interface
from handrail.policies.imitation.training.encoded import check_fits, encoded
from handrail.policies.imitation.training.memory import (
    PICTURES,
    MemoryDataset,
    MemoryMeta,
    check_finite,
    open_pictures,
    picture_stats,
    pictured,
)
from handrail.policies.imitation.training.selection import Row, Selection, hold_out, select, select_again

if TYPE_CHECKING:
    from lerobot.configs.policies import PreTrainedConfig

Columns = dict[str, np.ndarray]
Features = dict[str, Feature]
_LEARNT = ("observation", "action", "next.")
_CORRECTED = "corrected"  # a column of whether a frame counts as a correction
_READ_STATE = ("act", "diffusion", "multi_task_dit", "vqbet")  # of LeRobot's, what cannot do without it
_READ_SCENE = ("act", "diffusion")  # what needs pictures or the environment's state
_MODE = "teleop.mode"
_FLOOR = 1e-2  # [m, rad, m/s, …] least spread of a number: what hardly moved in training must not explode
_RANGES = (("min", "max"), ("q01", "q99"), ("q10", "q90"))


@dataclass(frozen=True)
class TrainingSource:
    """Chosen episodes of a dataset."""

    config: TrainConfig
    """The settings that chose them."""
    info: DatasetInfo
    selection: Selection
    interface: PolicyInterface | None
    """The policy's inputs and outputs; None where they are the recorded columns."""
    features: Features
    """Every column that it learns from, and every camera."""
    encoder: Encoder | None
    """Says instead of the dataset where things are."""
    columns: Columns
    """All columns of all episodes, (N, …) each, and LeRobot's counters."""

    @cached_property
    def digest(self) -> str:
        """Digest of the data: of the numbers in all columns, then of the pictures, if it sees any."""
        digest = hashlib.sha256()
        for key, values in sorted(self.columns.items()):
            digest.update(f"{key} {values.dtype} {values.shape}".encode())
            digest.update(np.ascontiguousarray(values).data)
        seen = digest_of_pictures(self.info, self.selection.rows) if self.config.images else ""
        return digest.hexdigest()[:16] + seen

    @property
    def trained_on(self) -> dict[str, float]:
        """The number of episodes that it learns from, of all attempts, and the time of these [s]."""
        learnt, held_out = self.split
        numbers: dict[str, float] = {
            "episodes": len(learnt),
            "attempts": self.selection.attempts,
            "operator_time": self.selection.operator_time,
        }
        return numbers | ({"held_out": len(held_out)} if held_out else {})

    @property
    def split(self) -> tuple[list[Row], list[Row]]:
        """The episodes to learn from, and those that are held out."""
        return hold_out(self.selection.rows, self.config)

    def only(self, rows: Sequence[Row]) -> "TrainingSource":
        """Return the source with some of its episodes, in their order."""
        numbers, all_rows = {row["episode_index"] for row in rows}, self.selection.rows
        inside = [row["episode_index"] in numbers for row in all_rows]
        kept = np.repeat(inside, [row["length"] for row in all_rows])
        columns = {key: values[kept] for key, values in self.columns.items()}
        selection = replace(self.selection, rows=tuple(rows))
        return replace(self, selection=selection, columns=columns | _counters(rows, self.info.fps))

    def dataset(self, policy: "PreTrainedConfig") -> MemoryDataset:
        """Return what LeRobot trains a policy on."""
        from lerobot.datasets.factory import resolve_delta_timestamps
        from lerobot.datasets.feature_utils import get_delta_indices

        rows = self.selection.rows
        features = {key: each.described | {"shape": each.shape} for key, each in self.features.items()}
        stats = {key: steadied(column_stats(self.columns[key])) for key in self.columns if key in features}
        lengths = tuple(row["length"] for row in rows)
        meta = MemoryMeta(features, stats, self.info.fps, lengths, self.info.robot_type)
        stamps = resolve_delta_timestamps(policy, meta) or {}  # pyright: ignore[reportArgumentType]
        pictures = None
        if cameras := meta.camera_keys:
            numbers = [row["episode_index"] for row in rows]
            seen = {key: stamps[key] for key in cameras if key in stamps}
            pictures = open_pictures(self.info, numbers, seen)
            stats |= {key: picture_stats(pictures, key) for key in cameras}
        windows = {key: w for key, w in get_delta_indices(stamps, meta.fps).items() if key in self.columns}
        columns = {key: torch.from_numpy(np.ascontiguousarray(v)) for key, v in self.columns.items()}
        kind, marked = self.config.corrections, self.columns.get(_CORRECTED, np.zeros(sum(lengths), bool))
        draws = Draws(kind, lengths, marked)
        return MemoryDataset(meta, columns, _sentences(rows), draws, windows, pictures)


def read_source(
    config: TrainConfig, began: PolicyMeta | None = None, earlier: PolicyMeta | None = None
) -> TrainingSource:
    """Read what a config asks for, or what a training began with.

    Args:
        config: what to train on.
        began: what the checkpoint says that the training goes on from.
        earlier: what the policy says whose weights it began with.
    """
    check_whole(root := config.dataset.folder, config.verify)
    info = read_info(root)
    if earlier and earlier.fps != info.fps:
        raise HandrailError(f"--init {config.init}: expected a policy of {info.fps} Hz, got {earlier.fps} Hz")
    rows = with_success(info, read_episodes(root))
    selection = select_again(rows, began) if began else select(rows, info.fps, config)
    encoder = find_encoder(config.encoder) if config.encoder else None
    if config.actions == "recorded":
        interface, features, columns = None, *_recorded(info, selection, config)
    else:
        known = earlier or began
        interface, features, columns = _interpreted(info, selection, config, config.actions, encoder, known)
    if config.images:
        if not (cameras := pictured(info)):
            raise HandrailError(f"--images: expected cameras in {str(info.root)!r}, found none")
        features |= cameras
    if not config.scene:
        features.pop(ENVIRONMENT, None)
        columns.pop(ENVIRONMENT, None)
    if config.corrections != "all":
        columns[_CORRECTED] = corrected(config.corrections, info, partial(_episodes, info, selection))
    columns |= _counters(selection.rows, info.fps)
    check_finite(f"dataset {str(root)!r}", selection.rows, columns)
    source = TrainingSource(config, info, selection, interface, features, encoder, columns)
    if began is not None and source.digest != began.data:
        count = began.trained_on.get("episodes", 0)
        raise HandrailError(f"--resume: expected the {count:g} episodes that it began with, got others")
    return source


def steadied(stats: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return statistics in which nothing is steadier than 0.01.

    A number that was the same throughout would otherwise be divided by (almost) nothing, and the least
    change of it when the policy drives would be huge.
    """
    stats = dict(stats, std=np.maximum(stats["std"], _FLOOR))
    for low, high in _RANGES:
        lack = np.maximum(0.0, _FLOOR - (stats[high] - stats[low]) / 2.0)
        stats |= {low: stats[low] - lack, high: stats[high] + lack}
    return stats


def _interpreted(
    info: DatasetInfo,
    selection: Selection,
    config: TrainConfig,
    actions: Literal["realised", "intent"],
    encoder: Encoder | None,
    known: PolicyMeta | None,
) -> tuple[PolicyInterface, Features, Columns]:
    """Return what a policy learns through an interface."""
    if actions == "intent":
        _check_one_mode(info, selection, config.mode)
    features = dict(info.features)
    if encoder and ENVIRONMENT not in features:
        names = encoder.reads.interface.environment_names
        features[ENVIRONMENT] = Feature("float32", (len(names),), names)
    if missing := [key for key in COLUMNS if key not in features]:
        words = f"found no {', '.join(missing)}; for other datasets say --actions recorded"
        raise HandrailError(f"--actions {actions}: expected the columns of handrail-record, {words}")
    masks = _episodes(info, selection, [MASK])
    interface = PolicyInterface.of_dataset(features, masks, actions, config.base_pose)
    if known and config.init:
        interface = same_interface(config.init, known, interface)
    if known and known.interface:  # it goes on with the view that it has
        interface = replace(interface, turned_velocities=known.interface.turned_velocities)

    def learnt(episode: Columns) -> Columns:
        state, environment = interface.observe(episode[STATE], episode[ENVIRONMENT])
        return {STATE: state, ENVIRONMENT: environment, ACTION: interface.encode(episode)}

    episodes = _episodes(info, selection, [key for key in COLUMNS if key in info.features])
    if encoder:
        check_fits(encoder, interface)
        episodes = encoded(info, selection.rows, encoder, episodes)
    columns = _joined(map(learnt, episodes))
    names = zip(columns, (*interface.observation_names, interface.action_names), strict=True)
    features = {key: Feature("float32", (len(each),), each) for key, each in names if each}
    return interface, features, {key: columns[key] for key in features}


def _check_one_mode(info: DatasetInfo, selection: Selection, said: str) -> None:
    """Check that an intent can be completed when the policy drives: as in its mode, and there is but one."""
    modes = {str(row.get("mode") or "") for row in selection.rows}
    if _MODE in info.features:  # people may change it while they drive
        driven = [set(episode[_MODE]) - {""} for episode in _episodes(info, selection, [_MODE])]
        modes = modes.union(*driven)
    if len(modes) > 1 or not modes <= {*MODES, *filter(MODES.accepts, (said,))}:
        words = "expected episodes of one teleop mode, whose controller completes the intent"
        found = ", ".join(sorted(mode or "no mode" for mode in modes))
        raise HandrailError(f"--actions intent: {words}; got {found}; say --mode, or --actions realised")


def _recorded(info: DatasetInfo, selection: Selection, config: TrainConfig) -> tuple[Features, Columns]:
    """Return what a policy learns of any dataset: its columns as they are."""
    where, cameras = f"dataset {str(info.root)!r}", pictured(info)
    features = {
        key: feature
        for key, feature in info.features.items()
        if key.startswith(_LEARNT) and feature.dtype not in (*PICTURES, "string")
    }
    if ACTION not in features:
        raise HandrailError(f"{where}: expected a column 'action', got {', '.join(features) or 'none'}")
    columns = _joined(_episodes(info, selection, list(features)))
    for key, values in columns.items():
        if values.dtype == np.float64 or key.startswith(POLICY_PREFIXES):
            columns[key] = values.astype(np.float32)  # LeRobot rounds their statistics to this type too
    if config.policy in _READ_SCENE and STATE in columns and not (ENVIRONMENT in columns or cameras):
        features[ENVIRONMENT], columns[ENVIRONMENT] = features[STATE], columns[STATE]
    numbers, needed = [key for key in features if key.startswith("observation")], ""
    if STATE not in numbers and config.policy in _READ_STATE:
        needed = f"a column {STATE!r}"
    elif not config.images and (not numbers or (config.policy in _READ_SCENE and ENVIRONMENT not in numbers)):
        needed = f"{ENVIRONMENT!r}, or pictures and --images,"
    if needed:
        found = ", ".join((*numbers, *cameras)) or "no observation"
        raise HandrailError(f"{where}: expected {needed} for policy {config.policy}; got {found}")
    return features, columns


def _episodes(info: DatasetInfo, selection: Selection, columns: Sequence[str]) -> Iterator[Columns]:
    """Yield columns of the selected episodes, one episode in memory at a time."""
    with data_files() as files:
        for row in selection.rows:
            yield read_rows_of(info, row, columns, files)


def _joined(episodes: Iterable[Columns]) -> Columns:
    """Return columns of episodes, one after the other."""
    parts: dict[str, list[np.ndarray]] = {}
    for episode in episodes:
        for key, values in episode.items():
            parts.setdefault(key, []).append(values)
    return {key: np.concatenate(parts.pop(key)) for key in list(parts)}


def _sentences(rows: Sequence[Row]) -> list[str]:
    return ["; ".join(row.get("tasks") or []) for row in rows]


def _counters(rows: Sequence[Row], fps: float) -> Columns:
    """Return the columns that LeRobot adds to every dataset, counted in the chosen part."""
    lengths, sentences = [row["length"] for row in rows], _sentences(rows)
    frames = np.concatenate([np.arange(length) for length in lengths])
    task = {sentence: number for number, sentence in enumerate(dict.fromkeys(sentences))}
    return {
        "timestamp": (frames / fps).astype(np.float32),
        "frame_index": frames,
        "episode_index": np.repeat(np.arange(len(lengths)), lengths),
        "index": np.arange(len(frames)),
        "task_index": np.repeat([task[sentence] for sentence in sentences], lengths),
    }
