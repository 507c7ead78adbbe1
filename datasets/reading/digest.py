"""One number for all rows of a dataset but its clocks: the same recording has the same, however it came."""

import hashlib
from pathlib import Path

from handrail.datasets.format.data_file import data_files
from handrail.datasets.reading.reader import read_episodes, read_info, read_rows_of

CLOCKS = ("wall_clock", "controller.solve_time")  # columns that no two recordings share


def digest_of_rows(root: Path) -> str:
    """Return a digest of every value of every row of a dataset that is in its tables, without the clocks.

    Raises:
        HandrailError: there is no dataset, or it cannot be read.
    """
    digest = hashlib.sha256()
    info = read_info(root)
    names = [name for name, each in info.features.items() if name not in CLOCKS and each.dtype != "video"]
    with data_files() as files:
        for row in read_episodes(root):
            frames = read_rows_of(info, row, names, files)
            for name in sorted(frames):
                values = frames[name]
                digest.update(f"{name} {values.shape} ".encode())
                digest.update(repr(values.tolist()).encode() if values.dtype == object else values.tobytes())
    return digest.hexdigest()[:16]
