"""Pictures of an episode, side by side, for people."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from handrail.datasets.storage.atomic import explained, write_whole

_GAP = 6  # between pictures [px]


def contact_sheet(pictures: Sequence[NDArray[np.uint8]], columns: int = 4) -> NDArray[np.uint8]:
    """Return the pictures in rows, in reading order, (height, width, 3).

    Args:
        pictures: of one size, (h, w, 3) each.
        columns: pictures a row.
    """
    tiles = [np.pad(picture, ((0, _GAP), (0, _GAP), (0, 0)), constant_values=255) for picture in pictures]
    tiles += [np.full_like(tiles[0], 255)] * (-len(tiles) % columns)
    rows = [np.hstack(tiles[start : start + columns]) for start in range(0, len(tiles), columns)]
    return np.pad(np.vstack(rows), ((_GAP, 0), (_GAP, 0), (0, 0)), constant_values=255)


def save_sheet(pictures: Sequence[NDArray[np.uint8]], path: Path) -> None:
    """Write a contact sheet as a .png file."""
    stream = io.BytesIO()
    Image.fromarray(contact_sheet(pictures)).save(stream, format="png")
    with explained(str(path)):
        write_whole(path, stream.getvalue())
