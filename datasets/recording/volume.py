"""Writing episodes into volumes: files of many, one of rows, one of lines and one video a camera each.

A volume ends when it is as large as LeRobot's files (100 MB of rows, 200 MB of video), and where a video is
encoded in another way. Nothing that is written is read or written again.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace as changed
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.columns import ColumnTypes, Scalar, fit_columns
from handrail.datasets.format.data_file import DataFiles, GrowingDataFile, data_files
from handrail.datasets.format.join import Stretch, VideoJoin, Videos, videos
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.lines import lines_bytes
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import EpisodeRecord, FileSeal, Totals
from handrail.datasets.format.schema import video_keys
from handrail.datasets.format.tables import data_schema
from handrail.datasets.format.video import decoded_stats, encode_stretch
from handrail.datasets.recording.piece import Piece
from handrail.datasets.storage.atomic import make_folder, remove, write_synced

MOST_ROWS, MOST_VIDEO = 100 * 2**20, 200 * 2**20  # [byte] of a file


def write_volumes(layout: Layout, manifest: Manifest, pieces: Iterable[Piece], types: ColumnTypes) -> Totals:
    """Write episodes in one pass into a folder that nobody reads before it is finished.

    Args:
        layout: The folder; its staging folder is there.
        manifest: The schema.
        pieces: The episodes, in order.
        types: Of the extra columns.

    Returns:
        What they add up to.

    Raises:
        HandrailError, ValueError: One does not fit.
        OSError: The disk does not take it.
    """
    totals, volume = Totals(), None
    with data_files() as files, videos(manifest.fps) as opened:
        try:
            for piece in pieces:
                stretches = _stretches(piece, manifest, opened, layout.staging)
                if volume is not None and not volume.takes(stretches):
                    volume.close(totals)
                    volume = None
                volume = volume or _Volume(layout, manifest, types, totals)
                totals = totals.grown(volume.add(piece, stretches, totals, files))
            if volume is not None:
                volume.close(totals)
        except BaseException:
            if volume is not None:
                volume.abandon()
            raise
    return totals


class _Volume:
    """The volume that is being written."""

    def __init__(self, layout: Layout, manifest: Manifest, types: ColumnTypes, totals: Totals):
        self._layout, self._manifest, self._types = layout, manifest, types
        self._slot, self._start = totals.episodes, totals.frames
        self._records: list[EpisodeRecord] = []
        streams = {key: layout.video(key, self._slot) for key in video_keys(manifest.features)}
        for path in (layout.data(self._slot), *streams.values()):
            make_folder(path.parent)
        self._joins = {key: VideoJoin(path, manifest.fps) for key, path in streams.items()}
        self._paths = [*streams.values(), layout.data(self._slot)]
        self._schema = data_schema(manifest.features)
        self._rows = GrowingDataFile(layout.data(self._slot), self._schema)

    def takes(self, stretches: Mapping[str, Stretch]) -> bool:
        """Return whether one more episode may be added."""
        full = self._rows.size >= MOST_ROWS or any(join.size >= MOST_VIDEO for join in self._joins.values())
        return not full and all(self._joins[key].fits(stretch) for key, stretch in stretches.items())

    def add(
        self, piece: Piece, stretches: Mapping[str, Stretch], totals: Totals, files: DataFiles
    ) -> EpisodeRecord:
        """Append an episode and return its line."""
        known: dict[str, Scalar] = {n: value for n, value in piece.columns.items() if value is not None}
        extras = fit_columns(known, self._types)
        table, tasks, stats = piece.rows(self._schema, self._manifest.fps, totals, files)
        for key, stretch in stretches.items():
            if piece.is_cut:
                camera, fps = self._manifest.features[key], self._manifest.fps
                stats |= {
                    key: decoded_stats(piece.videos[key], piece.length, camera, piece.first_picture, fps)
                }
            self._joins[key].add(stretch)
        self._rows.add(table)
        record = changed(
            piece.record,
            episode=totals.episodes,
            start=totals.frames,
            length=piece.length,
            tasks=tasks,
            stats={**(piece.record.stats or {}), **stats},
            columns=extras,
            slot=self._slot,
            offset=totals.frames - self._start,
        )
        self._records.append(record)
        return record

    def close(self, totals: Totals) -> None:
        """Finish the files; the lines, with the seals of the others, go last."""
        self._rows.close()
        for join in self._joins.values():
            join.close()
        seals = {self._layout.relative(path): FileSeal.of(path) for path in self._paths}
        records = [changed(record, files=seals) for record in self._records]
        path = self._layout.row(self._slot)
        make_folder(path.parent)
        kept = totals if len(records) > 1 else None
        write_synced(path, lines_bytes(self._manifest, records, self._types, kept))

    def abandon(self) -> None:
        """Let the files go, which the caller removes."""
        self._rows.abandon()
        for join in self._joins.values():
            join.close()


def _stretches(piece: Piece, manifest: Manifest, opened: Videos, staging: Path) -> dict[str, Stretch]:
    """Return what of each camera's video is to be joined; what cannot be copied is encoded anew."""
    found: dict[str, Stretch] = {}
    for key, video in piece.videos.items():
        stretch = opened.stretch(video, piece.first_picture, piece.length, key)
        if stretch is None:
            clip = staging / f"{key}.mp4"
            opened.forget(f"{key} anew")
            remove(clip)
            feature = manifest.features[key]
            encode_stretch(video, piece.first_picture, piece.length, clip, manifest.fps, feature)
            stretch = opened.stretch(clip, 0, piece.length, f"{key} anew")
        if stretch is None:
            raise HandrailError(f"video {str(video)!r}: expected pictures that can be cut out, got none")
        found[key] = stretch
    return found
