"""From a recorded dataset to what a policy is trained on: chosen episodes, seen through its interface."""

import hashlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import torch

from handrail.collect.operators.modes import MODES
from handrail.controllers.errors import HandrailError
from handrail.datasets.format.data_file import data_files
from handrail.datasets.format.stats import column_stats
from handrail.datasets.reading.check import check_whole
from handrail.datasets.reading.digest import digest_of_pictures
from handrail.datasets.reading.reader import DatasetInfo, read_episodes, read_info, read_rows_of, with_success
from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.interface.checkpoint import PolicyMeta
from handrail.policies.imitation.interface.interface import (
    ACTION,
    COLUMNS,
    ENVIRONMENT,
    MASK,
    STATE,
    PolicyInterface,
)
from handrail.policies.imitation.training.columns import (
    described,
    described_cameras,
    picture_stats,
    pictured,
    steadied,
)
from handrail.policies.imitation.training.memory import MemoryDataset, MemoryMeta
from handrail.policies.imitation.training.selection import Row, Selection, hold_out, select, select_again

if TYPE_CHECKING:
    from lerobot.configs.policies import PreTrainedConfig
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

Columns = dict[str, np.ndarray]
_LEARNT = ("observation", "action", "next.")
_NORMALISED = ("observation", "action")  # LeRobot rounds their statistics to the type that they come in
_COUNTERS = ("timestamp", "frame_index", "episode_index", "index", "task_index")
_NOWHERE = "handrail/local--only"  # no name on the hub, from where LeRobot would fetch what is missing
_READ_STATE = ("act", "diffusion", "multi_task_dit", "vqbet")  # of LeRobot's, what cannot do without it
_READ_SCENE = ("act", "diffusion")  # what needs pictures or the environment's state


@dataclass(frozen=True)
class TrainingSource:
    """Chosen episodes of a dataset.

    Attributes:
        config: what was asked for.
        info: the dataset.
        selection: the episodes.
        interface: what the policy reads and writes; None where that is what was recorded.
        features: LeRobot's description of every column and camera.
        columns: all columns of all episodes, (N, …) each.
    """

    config: TrainConfig
    info: DatasetInfo
    selection: Selection
    interface: PolicyInterface | None
    features: dict[str, dict[str, Any]]
    columns: Columns

    @cached_property
    def digest(self) -> str:
        """What tells the data apart: of the numbers in all columns, then of the pictures, if it sees any."""
        digest = hashlib.sha256()
        for key, values in sorted(self.columns.items()):
            digest.update(f"{key} {values.dtype} {values.shape}".encode())
            digest.update(np.ascontiguousarray(values).data)
        seen = digest_of_pictures(self.info, self.selection.rows) if self.config.images else ""
        return digest.hexdigest()[:16] + seen

    @property
    def trained_on(self) -> dict[str, float]:
        """How many episodes it learns from, how many attempts all took, and how long those were [s]."""
        chosen, (_, held_out) = self.selection, self.split
        numbers: dict[str, float] = {
            "episodes": len(chosen.rows) - len(held_out),
            "attempts": chosen.attempts,
            "operator_time": chosen.operator_time,
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
        selection = replace(self.selection, rows=tuple(rows))
        columns = {key: values[kept] for key, values in self.columns.items()}
        return replace(self, selection=selection, columns=columns | _counters(selection, self.info.fps))

    def dataset(self, policy: "PreTrainedConfig") -> MemoryDataset:
        """Return what LeRobot trains a policy on."""
        from lerobot.datasets.factory import resolve_delta_timestamps
        from lerobot.datasets.feature_utils import get_delta_indices

        lengths = tuple(row["length"] for row in self.selection.rows)
        stats = {key: steadied(column_stats(self.columns[key])) for key in self._numeric}
        meta = MemoryMeta(self.features, stats, self.info.fps, lengths, self.info.robot_type)
        stamps = resolve_delta_timestamps(policy, meta) or {}  # pyright: ignore[reportArgumentType]
        cameras = meta.camera_keys
        pictures = None
        if cameras:
            pictures = self._pictures({key: stamps[key] for key in cameras if key in stamps})
            stats |= {key: picture_stats(pictures, key) for key in cameras}
        windows = {
            key: offsets
            for key, offsets in get_delta_indices(stamps, meta.fps).items()
            if key in self.columns
        }
        columns = {key: torch.from_numpy(np.ascontiguousarray(v)) for key, v in self.columns.items()}
        sentences = ["; ".join(row.get("tasks") or []) for row in self.selection.rows]
        return MemoryDataset(meta, columns, sentences, windows, pictures)

    @property
    def _numeric(self) -> list[str]:
        return [key for key in self.columns if key in self.features]

    def _pictures(self, stamps: Mapping[str, list[float]]) -> "LeRobotDataset":
        from huggingface_hub.errors import HFValidationError
        from lerobot.datasets.lerobot_dataset import LeRobotDataset

        try:
            return LeRobotDataset(
                _NOWHERE,
                root=self.info.root,
                episodes=[row["episode_index"] for row in self.selection.rows],
                delta_timestamps=dict(stamps) or None,
            )
        except HFValidationError as error:
            raise HandrailError(
                f"dataset {str(self.info.root)!r}: expected all its files, found some missing"
            ) from error


def read_source(config: TrainConfig, began: PolicyMeta | None = None) -> TrainingSource:
    """Read what a config asks for, or what a training began with.

    Args:
        config: what to train on.
        began: what the checkpoint says that the training goes on from.
    """
    root = config.dataset.folder
    check_whole(root, config.verify)
    info = read_info(root)
    rows = with_success(info, read_episodes(root))
    if began is not None and began.episodes:
        selection = select_again(rows, began.episodes, began.trained_on)
    else:
        selection = select(rows, info.fps, config)
    if config.actions == "intent":
        _check_one_mode(selection, config.mode)
    if config.actions == "recorded":
        interface, features, columns = None, *_recorded(info, selection, config)
        _check_inputs(config, info, features)
    else:
        interface, features, columns = _interpreted(info, selection, config.actions, config.base_pose)
    if config.images:
        features |= described_cameras(info)
    if not config.scene:
        features.pop(ENVIRONMENT, None)
        columns.pop(ENVIRONMENT, None)
    return TrainingSource(
        config, info, selection, interface, features, columns | _counters(selection, info.fps)
    )


def _check_one_mode(selection: Selection, said: str) -> None:
    """Check that an intent can be completed when the policy drives: as in its mode, and there is but one."""
    modes = Counter(str(row.get("mode") or "") for row in selection.rows)
    if len(modes) == 1 and modes.keys() <= {*MODES, said} - {""}:
        return
    found = ", ".join(f"{mode or 'no mode'} ({count})" for mode, count in modes.most_common())
    known = next((mode for mode, _ in modes.most_common() if mode in MODES), None)
    flag = f"--mode {known}" if known else "--actions realised"
    raise HandrailError(
        f"--actions intent: expected episodes of one teleop mode, whose controller completes the intent when"
        f" the policy drives; got {found}; say {flag}"
    )


def _interpreted(
    info: DatasetInfo, selection: Selection, actions: Literal["realised", "intent"], base_pose: bool
) -> tuple[PolicyInterface, dict[str, dict[str, Any]], Columns]:
    missing = [key for key in COLUMNS if key not in info.features]
    if missing:
        raise HandrailError(
            f"--actions {actions}: expected the columns that handrail-record writes, found no"
            f" {', '.join(missing)}; for other datasets say --actions recorded"
        )
    masks = _each(info, selection, [MASK])
    interface = PolicyInterface.of_dataset(info.features, masks, actions, base_pose)
    columns = _joined(
        dict(zip((STATE, ENVIRONMENT), interface.observe(episode[STATE], episode[ENVIRONMENT]), strict=True))
        | {ACTION: interface.encode(episode)}
        for episode in _each(info, selection, COLUMNS)
    )
    names = dict(zip(columns, (*interface.observation_names, interface.action_names), strict=True))
    columns = {key: values for key, values in columns.items() if values.shape[1]}
    return interface, {key: described("float32", (len(names[key]),), names[key]) for key in columns}, columns


def _recorded(
    info: DatasetInfo, selection: Selection, config: TrainConfig
) -> tuple[dict[str, dict[str, Any]], Columns]:
    keys = [
        key
        for key, feature in info.features.items()
        if key.startswith(_LEARNT) and feature.dtype not in ("video", "image", "string")
    ]
    if ACTION not in keys:
        raise HandrailError(
            f"dataset {str(info.root)!r}: expected a column 'action', got {', '.join(keys) or 'none'}"
        )
    columns = _joined(
        {
            key: v.astype(np.float32) if v.dtype == np.float64 or key.startswith(_NORMALISED) else v
            for key, v in episode.items()
        }
        for episode in _each(info, selection, keys)
    )
    features = {key: described(f.dtype, f.shape, f.names) for key in keys for f in (info.features[key],)}
    if config.policy in _READ_SCENE and STATE in columns and not (ENVIRONMENT in columns or pictured(info)):
        features[ENVIRONMENT], columns[ENVIRONMENT] = features[STATE], columns[STATE]
    return features, columns


def _each(info: DatasetInfo, selection: Selection, columns: Sequence[str]) -> Iterator[Columns]:
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


def _check_inputs(config: TrainConfig, info: DatasetInfo, features: Mapping[str, Any]) -> None:
    """Check that there is what the policy reads, before LeRobot stumbles over what is not there."""
    numbers = [key for key in features if key.startswith("observation")]
    dataset, cameras = f"dataset {str(info.root)!r}", pictured(info)
    if STATE not in numbers and config.policy in _READ_STATE:
        beside = " beside pictures (--images)" if cameras else ""
        raise HandrailError(
            f"{dataset}: expected a column {STATE!r}, which policy {config.policy} needs{beside};"
            f" got {', '.join((*numbers, *cameras)) or 'no observation'}"
        )
    blind = not numbers or (config.policy in _READ_SCENE and ENVIRONMENT not in numbers)
    if blind and cameras and not config.images:
        raise HandrailError(
            f"{dataset}: expected {ENVIRONMENT!r} or --images for policy {config.policy};"
            f" there are pictures ({', '.join(cameras)}): say --images"
        )


def _counters(selection: Selection, fps: float) -> Columns:
    """Return the columns that LeRobot adds to every dataset, counted in the chosen part."""
    lengths = [row["length"] for row in selection.rows]
    frames = np.concatenate([np.arange(length) for length in lengths])
    sentences = ["; ".join(row.get("tasks") or []) for row in selection.rows]
    task = {sentence: number for number, sentence in enumerate(dict.fromkeys(sentences))}
    values = (
        (frames / fps).astype(np.float32),
        frames,
        np.repeat(np.arange(len(lengths)), lengths),
        np.arange(len(frames)),
        np.repeat([task[sentence] for sentence in sentences], lengths),
    )
    return dict(zip(_COUNTERS, values, strict=True))
