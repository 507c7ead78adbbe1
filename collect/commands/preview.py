"""A moving picture of an episode for a dataset's page, drawn while its commands run again."""

import io
from pathlib import Path

from PIL import Image

from handrail.collect.commands.replay import replay_one_of
from handrail.controllers.errors import HandrailError
from handrail.datasets.reading.reader import open_dataset

_PICTURES = 32
_WIDTH = 320  # [px]
_LONGEST = 125  # that a picture stays [ms]; a long episode goes by faster than it was


def preview(root: Path) -> bytes:
    """Return the first episode that succeeded, else the first, seen from the scene's camera, as WebP."""
    with open_dataset(root) as dataset:
        number = next((row["episode_index"] for row in dataset.rows if row.get("success")), 0)
        seconds = dataset.row(number)["length"] / dataset.info.fps
        found, pictures = replay_one_of(dataset, number, _PICTURES)
    if found.largest:
        raise HandrailError(f"episode {number} of {root}: expected an exact replay, got another motion")
    first, *others = [Image.fromarray(picture) for picture in pictures]
    for image in (first, *others):
        image.thumbnail((_WIDTH, _WIDTH))
    stay, stream = min(round(1000 * seconds / _PICTURES), _LONGEST), io.BytesIO()
    first.save(stream, "WEBP", save_all=True, append_images=others, duration=stay, loop=0, quality=70)
    return stream.getvalue()
