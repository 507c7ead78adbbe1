"""One camera's mp4, encoded in a thread of its own while the episode is recorded.

The queue to the thread is bounded and `add` waits for room: a picture is never dropped. After an error the
thread goes on emptying the queue, so that the recording is never stuck; `finish` raises what happened.
"""

import queue
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import Any

import av
import av.error
import numpy as np
from numpy.typing import NDArray

from handrail.controllers.errors import HandrailError, first_line
from handrail.controllers.regular_file import regular
from handrail.datasets.format.schema import Feature
from handrail.datasets.format.stats import Statistics, image_levels, image_stats
from handrail.datasets.storage.atomic import sync

QUEUE_LENGTH = 64  # pictures; 3 MB at 128 x 128, 59 MB at 640 x 480
GROUP, QUALITY, PRESET = 2, 23, "ultrafast"  # key frame every second picture: random access stays cheap
_OPTIONS = {  # one thread, since pictures are small and cameras run side by side
    **{"preset": PRESET, "crf": str(QUALITY), "g": str(GROUP)},
    **{"threads": "1", "x264-params": "log=-1"},
}


def video_info(feature: Feature, fps: int) -> dict[str, Any]:
    """Return what LeRobot keeps about a camera's videos in `info.json`."""
    return {
        "video.height": feature.shape[0],
        "video.width": feature.shape[1],
        "video.codec": "h264",
        "video.pix_fmt": "yuv420p",
        "video.fps": fps,
        "video.channels": 3,
        "has_audio": False,
        "video.g": GROUP,
        "video.crf": QUALITY,
        "video.preset": PRESET,
        "video.fast_decode": 0,
        "video.video_backend": "pyav",
        "video.extra_options": {},
        "is_depth_map": False,
    }


@contextmanager
def whole_mp4(path: Path) -> Iterator[None]:
    """Turn an error of reading an mp4 into one line."""
    try:
        yield
    except (av.error.FFmpegError, IndexError, ValueError) as error:  # ValueError: also text that is none
        raise HandrailError(f"video {str(path)!r}: expected a whole mp4, got {first_line(error)}") from error


def place_of(shown: Any, fps: int) -> int:
    """Return which picture of the video a packet or a frame is."""
    return round((shown.pts or 0) * (shown.time_base or 1) * fps)


def sought(container: Any, first: int, fps: int) -> Any:
    """Return the video of a file, at the key frame from which a picture can be decoded."""
    stream = container.streams.video[0]
    if stream.codec_context is None:
        raise ValueError("an unknown codec")
    if first:
        container.seek(round(first / Fraction(fps) / (stream.time_base or 1)), stream=stream)
    return stream


def count_frames(path: Path) -> int:
    """Return how many pictures an mp4 really holds; every packet is read."""
    with whole_mp4(path), av.open(str(regular(path))) as container:
        sizes = [packet.size for packet in container.demux(video=0)]
    return sum(size > 0 for size in sizes)


def decoded_stats(path: Path, frames: int, camera: Feature, first: int = 0, fps: int = 0) -> Statistics:
    """Decode every picture of an mp4, or of a stretch of one, and return their statistics.

    Args:
        path: The mp4.
        frames: Number of pictures.
        camera: The camera of the pictures.
        first: The picture that the stretch begins with.
        fps: Pictures a second [Hz]; 0 if these must be all pictures of the file.
    """
    return image_stats([image_levels(each) for each in decoded(path, frames, camera, first, fps)])


def decoded(
    path: Path, frames: int, camera: Feature, first: int = 0, fps: int = 0
) -> Iterator[NDArray[np.uint8]]:
    """Yield every picture of an mp4, or of a stretch of one, (height, width, 3); see `decoded_stats`."""
    count = 0
    with whole_mp4(path), av.open(str(regular(path))) as container:
        stream = sought(container, first, fps)
        stream.codec_context.options = {"err_detect": "explode"}
        for frame in _stretch(container, stream, first, frames, fps):
            if frame.is_corrupt or (frame.height, frame.width) != camera.shape[:2]:
                raise ValueError(f"a broken picture {count}, or one of another size")
            yield frame.to_ndarray(format="rgb24")
            count += 1
    if count != frames:
        raise HandrailError(f"video {str(path)!r}: expected {frames} pictures, got {count}")


def encode_stretch(source: Path, first: int, count: int, target: Path, fps: int, camera: Feature) -> None:
    """Write a stretch of an mp4 at `fps` [Hz], whose packets cannot be copied, as one of its own."""
    encoder = VideoEncoder(target, fps, camera)
    try:
        with whole_mp4(source), av.open(str(regular(source))) as container:
            for frame in _stretch(container, sought(container, first, fps), first, count, fps):
                encoder.add(frame.to_ndarray(format="rgb24"))
    except BaseException:
        encoder.cancel()
        raise
    encoder.finish(count)


def _stretch(container: Any, stream: Any, first: int, count: int, fps: int) -> Iterator[Any]:
    """Yield the pictures of a stretch; without `fps`, those of the whole file."""
    for frame in container.decode(stream):
        place = place_of(frame, fps)
        if fps and place >= first + count:
            return
        if place >= first:
            yield frame


class VideoEncoder:
    """Writes the pictures of one camera and one episode, in order, into one mp4."""

    def __init__(self, path: Path, fps: int, feature: Feature):
        """Start the thread; the file appears with the first picture.

        Args:
            path: Where the mp4 goes (a temporary name).
            fps: Pictures a second [Hz].
            feature: The camera.
        """
        self._path, self._fps, self._feature = path, fps, feature
        self._queue: queue.Queue[np.ndarray | None] = queue.Queue(maxsize=QUEUE_LENGTH)
        self._levels: list[np.ndarray] = []
        self._error: Exception | None = None
        self._cancelled = False
        self._thread = threading.Thread(target=self._run, name=f"encode {path.name}", daemon=True)
        self._thread.start()

    def add(self, image: np.ndarray) -> None:
        """Hand over a copy of a picture, `(height, width, 3)` uint8; waits while the queue is full."""
        self._queue.put(np.array(image, order="C"))

    def finish(self, expected: int) -> Statistics:
        """Wait for the last picture, sync the file, check that it holds as many as expected.

        Returns:
            The statistics of the pictures.
        """
        self._stop()
        if self._error is not None:
            raise HandrailError(f"encoder of {self._path.name}: {self._error}") from self._error
        found = count_frames(self._path)
        if found != expected:
            raise HandrailError(f"encoder of {self._path.name}: expected {expected} pictures, got {found}")
        sync(self._path)
        return image_stats(self._levels)

    def cancel(self) -> None:
        """Stop without finishing; the caller removes the file. Safe to call at any time."""
        self._cancelled = True
        self._stop()

    def _stop(self) -> None:
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join()

    def _run(self) -> None:
        images = self._images()
        try:
            for image in images:  # the first one opens the file
                self._encode(chain([image], images))
        except Exception as error:  # whatever it is, `finish` raises it in the recorder's thread
            self._error = error
            for _ in images:
                pass

    def _images(self) -> Iterator[np.ndarray]:
        while (image := self._queue.get()) is not None:
            yield image

    def _encode(self, images: Iterable[np.ndarray]) -> None:
        time_base = Fraction(1, self._fps)
        with av.open(str(self._path), "w", format="mp4") as container:
            stream: Any = container.add_stream("libx264", rate=self._fps, options=_OPTIONS)
            stream.height, stream.width = self._feature.shape[:2]
            stream.pix_fmt, stream.time_base = "yuv420p", time_base
            for image in images:
                if not self._cancelled:
                    frame = av.VideoFrame.from_ndarray(image, format="rgb24")
                    frame.pts, frame.time_base = len(self._levels), time_base
                    container.mux(stream.encode(frame))
                    self._levels.append(image_levels(image))
            container.mux(stream.encode(None))
