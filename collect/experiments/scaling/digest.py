"""One number for all rows of a dataset but its clocks: the same recording has the same, however it came."""

import hashlib
from pathlib import Path

from handrail.datasets.reading.reader import read_episodes, read_frames, read_info

CLOCKS = ("wall_clock", "controller.solve_time")  # columns that no two recordings share


def digest_of_rows(root: Path) -> str:
    """Return a digest of every value of every row of a dataset that is in its tables, without the clocks.

    Raises:
        HandrailError: there is no dataset, or it cannot be read.
    """
    digest = hashlib.sha256()
    features = read_info(root).features
    names = [name for name in features if name not in CLOCKS and features[name].dtype != "video"]
    for row in read_episodes(root):
        frames = read_frames(root, row["episode_index"], names)
        for name in sorted(frames):
            digest.update(f"{name} {frames[name].shape} ".encode())
            values = frames[name]
            digest.update(repr(values.tolist()).encode() if values.dtype == object else values.tobytes())
    return digest.hexdigest()[:16]
