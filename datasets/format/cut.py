"""Cutting pictures out of an mp4: packets are copied where that can be, else they are encoded anew."""

from pathlib import Path

import av
import av.error

from handrail.controllers.errors import HandrailError
from handrail.controllers.regular_file import regular
from handrail.datasets.format.join import VideoJoin, place_of, videos
from handrail.datasets.format.schema import Feature
from handrail.datasets.format.video import VideoEncoder


def cut_video(source: Path, first: int, count: int, target: Path, fps: int, feature: Feature) -> None:
    """Write a stretch of a video as one of its own.

    Args:
        source: An mp4 at `fps`.
        first: The picture that it begins with.
        count: Number of pictures.
        target: The new mp4.
        fps: Pictures a second [Hz].
        feature: The camera.

    Raises:
        HandrailError: The source is not a whole mp4, or has no such pictures.
        OSError: The disk does not take it.
    """
    with videos(fps) as opened:
        stretch = opened.stretch(source, first, count)
        if stretch is not None:
            join = VideoJoin(target, fps)
            join.add(stretch)
            join.close()
    if stretch is None:
        encode_stretch(source, first, count, target, fps, feature)


def encode_stretch(source: Path, first: int, count: int, target: Path, fps: int, feature: Feature) -> None:
    """Write a stretch of a video as one of its own whose pictures are encoded anew; see `cut_video`."""
    encoder = VideoEncoder(target, fps, feature)
    try:
        with av.open(str(regular(source))) as container:
            stream = container.streams.video[0]
            container.seek(round(first / (fps * (stream.time_base or 1))), stream=stream)
            for frame in container.decode(stream):
                place = place_of(frame, fps)
                if first <= place < first + count:
                    encoder.add(frame.to_ndarray(format="rgb24"))
                if place >= first + count - 1:
                    break
    except (av.error.FFmpegError, IndexError, ValueError) as error:
        encoder.cancel()
        raise HandrailError(f"video {str(source)!r}: expected a whole mp4, got {error}") from error
    except BaseException:
        encoder.cancel()
        raise
    encoder.finish(count)
