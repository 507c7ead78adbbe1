"""An h264 video file that takes one picture after another, and is there whole or not at all."""

import os
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Self

import av
import numpy as np
from numpy.typing import NDArray

from handrail.datasets.storage.atomic import beside, explained, sync_file, sync_folder


class VideoFile:
    """Encodes pictures; a context that gives the file its name at the end, unless something went wrong.

    Args:
        path: of the file, .mp4.
        size: height and width of the pictures [px]; both even, as h264 wants.
        fps: pictures a second.
    """

    def __init__(self, path: Path, size: tuple[int, int], fps: int | Fraction) -> None:
        self._path, self._partial = path, beside(path, "partial")
        self._container = av.open(str(self._partial), "w", format="mp4")
        rate = Fraction(fps)
        self._stream = self._container.add_stream(
            "libx264", rate=rate, options={"crf": "20", "preset": "medium", "x264-params": "log=-1"}
        )
        self._stream.height, self._stream.width = size
        self._tick = 1 / rate  # [s]; the muxer may choose another for the file
        self._stream.pix_fmt, self._stream.time_base = "yuv420p", self._tick
        self._count = 0

    def __enter__(self) -> Self:
        """Begin."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write what the encoder still holds and close the file; after an error remove it."""
        try:
            with explained(str(self._path)):
                if error is None:
                    self._container.mux(self._stream.encode(None))
                self._container.close()
                if error is None:
                    sync_file(self._partial)
                    os.replace(self._partial, self._path)
                    sync_folder(self._path.parent)
        finally:
            self._partial.unlink(missing_ok=True)

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Add a picture, (height, width, 3)."""
        frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
        frame.pts, frame.time_base = self._count, self._tick
        with explained(str(self._path)):
            self._container.mux(self._stream.encode(frame))
        self._count += 1
