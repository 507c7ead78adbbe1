"""An h264 video file that takes one picture after another."""

from fractions import Fraction
from pathlib import Path
from types import TracebackType

import av
import numpy as np
from numpy.typing import NDArray


class VideoFile:
    """Encodes pictures; a context that closes the file.

    Args:
        path: of the file, .mp4.
        size: height and width of the pictures [px]; both even, as h264 wants.
        fps: pictures a second.
    """

    def __init__(self, path: Path, size: tuple[int, int], fps: int | Fraction) -> None:
        self._container = av.open(str(path), "w", format="mp4")
        rate = Fraction(fps)
        self._stream = self._container.add_stream(
            "libx264", rate=rate, options={"crf": "20", "preset": "medium", "x264-params": "log=-1"}
        )
        self._stream.height, self._stream.width = size
        self._tick = 1 / rate  # [s]; the muxer may choose another for the file
        self._stream.pix_fmt, self._stream.time_base = "yuv420p", self._tick
        self._count = 0

    def __enter__(self) -> "VideoFile":
        """Begin."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write what the encoder still holds and close the file."""
        self._container.mux(self._stream.encode(None))
        self._container.close()

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Add a picture, (height, width, 3)."""
        frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
        frame.pts, frame.time_base = self._count, self._tick
        self._container.mux(self._stream.encode(frame))
        self._count += 1
