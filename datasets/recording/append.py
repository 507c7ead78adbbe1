"""Saving an episode that was recorded once under a dataset's next number, when a repair puts it back."""

import os
import shutil
from dataclasses import replace as changed
from pathlib import Path

from handrail.controllers.regular_file import regular
from handrail.datasets.format.columns import ColumnTypes, Scalar, fit_columns
from handrail.datasets.format.cut import cut_video
from handrail.datasets.format.data_file import data_files
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.lines import lines_bytes
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import EpisodeRecord, FileSeal, Totals
from handrail.datasets.format.stats import Stats
from handrail.datasets.format.tables import data_schema, parquet_bytes
from handrail.datasets.recording.piece import Piece
from handrail.datasets.recording.volume import pictures_of
from handrail.datasets.storage.atomic import make_folder, move, remove, sync_file, write_synced


def append_episode(
    layout: Layout,
    manifest: Manifest,
    piece: Piece,
    types: ColumnTypes,
    totals: Totals,
    origin: str = "",
) -> EpisodeRecord:
    """Save a piece under the next number, in the order in which the writer saves an episode.

    Args:
        layout: Of the dataset, whose staging folder is there.
        manifest: The schema of both.
        piece: What is saved.
        types: Of the dataset's extra columns.
        totals: What the dataset's episodes add up to.
        origin: What the new line says of the one that the episode had, or "".

    Returns:
        The new line.

    Raises:
        HandrailError, ValueError: It has columns that the dataset does not have, tasks that do not add up, or
            a video that cannot be cut.
    """
    known: dict[str, Scalar] = {name: value for name, value in piece.columns.items() if value is not None}
    extras = fit_columns(known, types)
    number, staging = totals.episodes, layout.staging
    streams = {layout.data(number): staging / "data.parquet"}
    with data_files() as files:
        table, tasks, stats = piece.rows(data_schema(manifest.features), manifest.fps, totals, files)
    write_synced(staging / "data.parquet", parquet_bytes(table))
    for key, video in piece.videos.items():
        streams[layout.video(key, number)] = staged = staging / f"{key}.mp4"
        stats |= _pictures(piece, key, video, staged, manifest)
    record = changed(
        piece.record,
        episode=number,
        start=totals.frames,
        length=piece.length,
        tasks=tasks,
        stats={**(piece.record.stats or {}), **stats},
        columns=extras,
        files={layout.relative(path): FileSeal.of(staged) for path, staged in streams.items()},
        slot=number,
        offset=0,
        alone=True,
    )
    write_synced(staging / "row.parquet", lines_bytes(manifest, [record], types, origin=origin))
    for path, staged in streams.items():
        move(staged, path)
    move(staging / "row.parquet", layout.row(number))  # the commit
    return record


def _pictures(piece: Piece, key: str, video: Path, staged: Path, manifest: Manifest) -> Stats:
    """Stage a camera's video; return its statistics if they are others than before."""
    if piece.record.alone and not piece.is_cut:
        copy_file(video, staged)
        return {}
    remove(staged)
    cut_video(video, piece.first_picture, piece.length, staged, manifest.fps, manifest.features[key])
    sync_file(staged)
    return {key: pictures_of(piece, key, manifest)} if piece.is_cut else {}


def copy_file(source: Path, target: Path) -> None:
    """Give a file a second name, or copy it where the file system has no such thing."""
    make_folder(target.parent)
    remove(target)
    try:
        os.link(regular(source), target)
    except OSError:
        shutil.copyfile(regular(source), target)
    sync_file(target)
