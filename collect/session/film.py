"""Pictures of episodes for people: a video file, the video of an episode, a contact sheet."""

import io
import os
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Self

import av
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from handrail.collect.world.env import HandrailEnv
from handrail.datasets.recording.frames import Frame
from handrail.datasets.storage.atomic import beside, explained, sync, write_whole

_font = cache(ImageFont.load_default)
SIZE = (540, 960)  # height, width [px]
_BAR = 64  # height of the caption [px]; both even, as h264 wants
_GAP = 6  # between pictures [px]
_INSET = 180  # height of a small picture in a film [px]


class VideoFile:
    """Encodes pictures; a context that gives the file its name at the end, unless something went wrong.

    Args:
        path: of the file, .mp4.
        size: height and width of the pictures [px]; both even, as h264 wants.
        fps: pictures a second.
    """

    def __init__(self, path: Path, size: tuple[int, int], fps: int) -> None:
        self._path, self._partial = path, beside(path.absolute(), "partial")  # "a:b" is none of FFmpeg's URLs
        self._container = av.open(str(self._partial), "w", format="mp4")
        self._stream = self._container.add_stream(
            "libx264", rate=fps, options={"crf": "20", "preset": "medium", "x264-params": "log=-1"}
        )
        self._stream.height, self._stream.width = size
        self._tick = Fraction(1, fps)  # [s]; the muxer may choose another for the file
        self._stream.pix_fmt, self._stream.time_base = "yuv420p", self._tick
        self._count = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        """Write what the encoder still holds and close the file; after an error remove it."""
        try:
            with explained(str(self._path)):
                if error is None:
                    self._container.mux(self._stream.encode(None))
                self._container.close()
                if error is None:
                    sync(self._partial)
                    os.replace(self._partial, self._path)
                    sync(self._path.parent)
        finally:
            self._partial.unlink(missing_ok=True)

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Add a picture, (height, width, 3)."""
        frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
        frame.pts, frame.time_base = self._count, self._tick
        with explained(str(self._path)):
            self._container.mux(self._stream.encode(frame))
        self._count += 1


class Filmer(VideoFile):
    """Adds one picture a control period to a file; an observer.

    The environment renders pictures of `SIZE`.

    Args:
        path: of the file, .mp4.
        fps: pictures a second.
        title: first line of the caption.
        words: second line, at a moment.
        insets: pictures that are shown small in a corner, at a moment.
    """

    def __init__(
        self,
        path: Path,
        fps: int,
        title: str,
        words: Callable[[Frame], str],
        insets: Callable[[Frame], Sequence[NDArray[np.uint8]]] = lambda frame: (),
    ) -> None:
        super().__init__(path, (SIZE[0] + _BAR, SIZE[1]), fps)
        self._title, self._words, self._insets = title, words, insets

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note of the environment."""
        self._env = env

    def see(self, frame: Frame) -> None:
        """Add the picture of this moment."""
        picture = self._env.render()
        if picture is not None:
            picture = with_insets(picture, self._insets(frame))
            self.add(captioned(picture, _BAR, (self._title, 9, 20), (self._words(frame), 37, 16)))


def with_insets(picture: NDArray[np.uint8], insets: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Return a picture with smaller ones side by side in its upper left corner."""
    image, left = Image.fromarray(picture), _GAP
    for inset in insets:
        small = Image.fromarray(inset)
        small = small.resize((round(small.width * _INSET / small.height), _INSET))
        image.paste(small, (left, _GAP))
        left += small.width + _GAP
    return np.array(image)


def captioned(picture: NDArray[np.uint8], bar: int, *lines: tuple[str, int, int]) -> NDArray[np.uint8]:
    """Return a picture on top of a dark bar with a title and a quieter line.

    Args:
        picture: (height, width, 3).
        bar: its height [px].
        lines: what each says, how far below the picture, and in which size [px].
    """
    height, width = picture.shape[:2]
    image = Image.new("RGB", (width, height + bar), (24, 26, 30))
    image.paste(Image.fromarray(picture))
    draw = ImageDraw.Draw(image)
    for (text, below, size), colour in zip(lines, ((245, 245, 245), (190, 195, 205)), strict=True):
        draw.text((12, height + below), text, font=_font(size), fill=colour)
    return np.array(image)


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
