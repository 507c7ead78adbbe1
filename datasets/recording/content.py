"""Whether a file with another checksum than it was saved with still holds its episodes."""

from pathlib import Path

import numpy as np

from handrail.controllers.errors import HandrailError, first_line
from handrail.datasets.format.data_file import DataFile, data_files
from handrail.datasets.format.episode_rows import EpisodeRows
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import EpisodeRecord
from handrail.datasets.format.schema import AUTOMATIC
from handrail.datasets.format.stats import column_stats
from handrail.datasets.format.tables import UNREADABLE, column_values, stored_features
from handrail.datasets.format.video import decoded_stats

_KEPT = ("min", "max", "mean", "std")
_SHADE = 0.03  # of full brightness: how far encoding anew may move the mean of a colour


def content_faults(path: Path, name: str, manifest: Manifest, rows: EpisodeRows) -> list[str]:
    """Return how each episode in a file that was rewritten differs from what was saved, or "".

    Args:
        path: The file.
        name: Its path in the dataset.
        manifest: The schema.
        rows: The episode rows of its group.
    """
    faults, alone = [], len(rows) == 1  # then the file must hold nothing else
    with data_files() as files:
        for record in rows.records(with_stats=True):
            try:
                if name.startswith("data/"):
                    fault = _rows_fault(files.open(path), manifest, record, alone)
                else:
                    fault = _pictures_fault(path, name.split("/")[1], manifest, record, alone)
            except (HandrailError, *UNREADABLE) as error:
                fault = first_line(error)
            faults.append(fault)
    return faults


def _pictures_fault(path: Path, key: str, manifest: Manifest, record: EpisodeRecord, alone: bool) -> str:
    stretch = (0, 0) if alone else (record.offset, manifest.fps)
    now = decoded_stats(path, record.length, manifest.features[key], *stretch)
    saved = (record.stats or {})[key]
    same = all(np.abs(now[name] - saved[name]).max() < _SHADE for name in ("mean", "std"))
    return "" if same else "it shows other pictures than were saved"


def _rows_fault(file: DataFile, manifest: Manifest, record: EpisodeRecord, alone: bool) -> str:
    """Return how rows that can be read differ from those that were saved, or ""."""
    table = file.all() if alone else file.rows(record.episode)
    lacking = [name for name in stored_features(manifest.features) if name not in table.column_names]
    if lacking or table.num_rows != record.length:
        return f"{table.num_rows} rows instead of {record.length}" + "".join(f", no {n}" for n in lacking[:1])
    frames = np.arange(record.length)
    expected = {"frame_index": frames, "index": frames + record.start, "episode_index": record.episode}
    for name, wanted in expected.items():
        if not np.array_equal(column_values(table, name), np.broadcast_to(wanted, frames.shape)):
            return f"{name} is not that of episode {record.episode}"
    for name, saved in (record.stats or {}).items():
        if name in table.column_names and name not in AUTOMATIC:
            now = column_stats(column_values(table, name))
            if not all(np.allclose(now[each], saved[each].ravel(), rtol=1e-5, atol=1e-8) for each in _KEPT):
                return f"{name} holds other numbers than were saved"
    return ""
