"""Pictures of an episode, side by side, for people."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from handrail.datasets.storage.atomic import explained, write_whole


def contact_sheet(pictures: Sequence[NDArray[np.uint8]], columns: int = 4, gap: int = 6) -> NDArray[np.uint8]:
    """Return the pictures in rows, in reading order, (height, width, 3).

    Args:
        pictures: of one size, (h, w, 3) each.
        columns: pictures a row.
        gap: between them [pixels].
    """
    height, width, _ = pictures[0].shape
    rows = -(-len(pictures) // columns)
    sheet = np.full((rows * (height + gap) + gap, columns * (width + gap) + gap, 3), 255, dtype=np.uint8)
    for index, picture in enumerate(pictures):
        row, column = divmod(index, columns)
        top, left = gap + row * (height + gap), gap + column * (width + gap)
        sheet[top : top + height, left : left + width] = picture
    return sheet


def save_sheet(pictures: Sequence[NDArray[np.uint8]], path: Path) -> None:
    """Write a contact sheet as a .png file.

    Raises:
        HandrailError: it cannot be written.
    """
    stream = io.BytesIO()
    Image.fromarray(contact_sheet(pictures)).save(stream, format="png")
    with explained(str(path)):
        write_whole(path, stream.getvalue())
