"""What files of a dataset say, decoded into typed values where it enters: a dataset may come from anybody."""

import math
from collections.abc import Mapping
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from handrail.controllers.errors import shown
from handrail.datasets.format.layout import VIDEO_PATH
from handrail.datasets.format.path_pattern import check_pattern
from handrail.datasets.format.schema import Feature

Episodes = Annotated[int, Meta(ge=0, le=10**7)]
Frames = Annotated[int, Meta(ge=0, le=10**12)]
_Rate = Annotated[int, Meta(gt=0, le=10_000)] | Annotated[float, Meta(gt=0, le=10_000)]
_LARGEST = 10**8  # numbers a frame and feature


class _Column(msgspec.Struct):
    dtype: str
    shape: list[Annotated[int, Meta(ge=0)]]
    names: list[Any] | dict[str, Any] | None = None


class InfoFile(msgspec.Struct):
    """`info.json` of any LeRobot v3.0 dataset; what else it says is of no use here."""

    fps: _Rate
    """Frames a second [Hz]; LeRobot's are whole."""
    features: dict[str, dict[str, Any]]
    total_episodes: Episodes
    total_frames: Frames
    data_path: str
    video_path: str | None = None
    robot_type: str | None = None

    def __post_init__(self) -> None:
        check_pattern(self.data_path, ("chunk_index", "file_index"))
        check_pattern(self.video_path or VIDEO_PATH, ("video_key", "chunk_index", "file_index"))


class ManifestFile(msgspec.Struct):
    """`handrail.json` of a dataset that Handrail wrote."""

    repo_id: str
    fps: int
    robot_type: str
    features: dict[str, dict[str, Any]]
    versions: dict[str, Any]


class EpisodeLine(msgspec.Struct, kw_only=True):
    """What a row of `meta/episodes` says of any dataset's episode."""

    episode_index: Frames
    length: Frames
    chunk: Frames = msgspec.field(name="data/chunk_index")
    file: Frames = msgspec.field(name="data/file_index")
    tasks: list[str] | None = None


class SavedLine(EpisodeLine, kw_only=True):
    """What it says of an episode that Handrail saved."""

    dataset_from_index: Frames
    tasks: list[str] = msgspec.field()


class SavedTotals(msgspec.Struct):
    """What all episodes up to the last one of a file add up to."""

    episodes: Episodes
    frames: Frames
    tasks: list[str]
    stats: dict[str, dict[str, list[Any]]]


def columns_of(described: Mapping[str, Mapping[str, Any]]) -> dict[str, Feature]:
    """Return the columns of a dataset as a file describes them.

    Raises:
        ValueError: One is described by something else; one line.
    """
    return {key: _column(key, value) for key, value in described.items()}


def _column(key: str, described: Mapping[str, Any]) -> Feature:
    try:
        column = msgspec.convert(described, _Column)
        if math.prod(column.shape) > _LARGEST:
            raise ValueError(f"a shape of {_LARGEST} numbers at most, got {shown(column.shape)}")
    except ValueError as error:
        raise ValueError(f"feature {key[:60]!r}: {error}") from error
    names = column.names
    if isinstance(names, dict):  # older datasets: {"motors": [...]}
        names = next((entry for entry in names.values() if isinstance(entry, list)), None)
    if names and column.dtype not in ("video", "image") and [len(names)] != column.shape[:1]:
        names = None  # they name something else
    return Feature(column.dtype, tuple(column.shape), tuple(names) if names else None)
