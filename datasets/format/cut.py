"""Pictures out of the middle of an mp4, encoded anew where their packets cannot be copied."""

from pathlib import Path

import av
import av.error

from handrail.controllers.errors import HandrailError
from handrail.controllers.regular_file import regular
from handrail.datasets.format.join import place_of
from handrail.datasets.format.schema import Feature
from handrail.datasets.format.video import VideoEncoder


def encode_stretch(source: Path, first: int, count: int, target: Path, fps: int, feature: Feature) -> None:
    """Write a stretch of a video as one of its own whose pictures are encoded anew.

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
