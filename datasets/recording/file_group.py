"""Writing episodes into file groups: one file of rows, one of episode rows and one video a camera for many.

A group ends when it is as large as LeRobot's files (100 MB of rows, 200 MB of video), where a video is
encoded in another way, and where LeRobot would not find a picture of a long video. Nothing that is written is
read or written again.
"""

from dataclasses import replace

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.data_file import DataFiles, GrowingDataFile
from handrail.datasets.format.episode_rows import rows_bytes
from handrail.datasets.format.join import Stretch, VideoJoin, Videos
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import Checksum, ColumnTypes, EpisodeRecord, Totals, fit_columns
from handrail.datasets.format.tables import data_schema
from handrail.datasets.format.video import decoded_stats, encode_stretch
from handrail.datasets.recording.slice import EpisodeSlice
from handrail.datasets.storage.atomic import make_folder, remove, write_synced

MOST_ROWS, MOST_VIDEO = 100 * 2**20, 200 * 2**20  # [byte] of a file


class GroupWriter:
    """Writes one file group after the other, into a folder that nobody reads before it is finished.

    Args:
        layout: Of the folder; its staging folder is there.
        manifest: The schema.
        types: Of the extra columns.

    Attributes:
        totals: What all episodes so far add up to.
    """

    def __init__(self, layout: Layout, manifest: Manifest, types: ColumnTypes):
        self._layout, self._manifest, self._types = layout, manifest, types
        self._schema = data_schema(manifest.features)
        self._files, self._videos = DataFiles(), Videos(manifest.fps)
        self._rows: GrowingDataFile | None = None  # of the group that is being written
        self._joins: dict[str, VideoJoin] = {}
        self._records: list[EpisodeRecord] = []
        self.totals = self._before = Totals()  # of all episodes; of those before the group

    def add(self, piece: EpisodeSlice) -> None:
        """Append an episode.

        Raises:
            HandrailError, ValueError: It does not fit.
            OSError: The disk does not take it.
        """
        stretches = {key: self._stretch(piece, key) for key in piece.videos}
        rows = self._group(piece, stretches)
        known = {name: value for name, value in piece.columns.items() if value is not None}
        extras = fit_columns(known, self._types)
        table, tasks, stats = piece.rows(self._schema, self._manifest.fps, self.totals, self._files)
        for key, stretch in stretches.items():
            if piece.is_cut:
                cut = piece.length, self._manifest.features[key], piece.first_picture, self._manifest.fps
                stats[key] = decoded_stats(piece.videos[key], *cut)
            self._joins[key].add(stretch)
        rows.add(table)
        record = replace(
            piece.record,
            episode=self.totals.episodes,
            start=self.totals.frames,
            length=piece.length,
            tasks=tasks,
            stats={**(piece.record.stats or {}), **stats},
            columns=extras,
            file_index=self._before.episodes,
            offset=self.totals.frames - self._before.frames,
        )
        self._records.append(record)
        self.totals = self.totals.grown(record)

    def finish(self) -> None:
        """Finish the files of a group; its episode rows, with the checksums of the others, go last."""
        if self._rows is None:
            return
        self._rows.close()
        for join in self._joins.values():
            join.close()
        paths = [*(join.target for join in self._joins.values()), self._layout.data(self._before.episodes)]
        files = {self._layout.relative(path): Checksum.of(path) for path in paths}
        records = [replace(record, files=files) for record in self._records]
        path = self._layout.row(self._before.episodes)
        make_folder(path.parent)
        kept = self.totals if len(records) > 1 else None
        write_synced(path, rows_bytes(self._manifest, records, self._types, kept))
        self._rows = None

    def close(self) -> None:
        """Let go what is open; the caller removes a group that is not finished."""
        if self._rows is not None:
            self._rows.abandon()
            for join in self._joins.values():
                join.close()
        self._files.close()
        self._videos.close()

    def _group(self, piece: EpisodeSlice, stretches: dict[str, Stretch]) -> GrowingDataFile:
        """Return the rows of the group that an episode is added to: the open one, or a new one."""
        rows, joins = self._rows, self._joins
        fit = (joins[key].size < MOST_VIDEO and joins[key].fits(each) for key, each in stretches.items())
        if rows is not None and rows.size < MOST_ROWS and all(fit):
            return rows
        self.finish()
        self._before, self._records = self.totals, []
        first = self._before.episodes
        data, videos = self._layout.data(first), {key: self._layout.video(key, first) for key in piece.videos}
        for path in (data, *videos.values()):
            make_folder(path.parent)
        self._joins = {key: VideoJoin(path, self._manifest.fps) for key, path in videos.items()}
        self._rows = GrowingDataFile(data, self._schema)
        return self._rows

    def _stretch(self, piece: EpisodeSlice, key: str) -> Stretch:
        """Return what of a camera's video is to be joined; what cannot be copied is encoded anew."""
        video, first, count = piece.videos[key], piece.first_picture, piece.length
        stretch = self._videos.stretch(video, first, count, key)
        if stretch is None:
            clip, anew = self._layout.staging / f"{key}.mp4", f"{key} anew"
            self._videos.forget(anew)
            remove(clip)
            encode_stretch(video, first, count, clip, self._manifest.fps, self._manifest.features[key])
            stretch = self._videos.stretch(clip, 0, count, anew)
        if stretch is None:
            raise HandrailError(f"video {str(video)!r}: expected pictures that can be cut out, got none")
        return stretch
