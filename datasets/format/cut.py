"""Cutting pictures out of an mp4: packets are copied where that can be, else they are encoded anew.

A stretch can be copied if it begins with a key frame and no picture in it needs one that is left out.
"""

from pathlib import Path
from typing import Any

import av
import av.error

from handrail.controllers.errors import HandrailError
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
    try:
        if not _copied(source, first, count, target, fps):
            _encoded(source, first, count, target, fps, feature)
    except (av.error.FFmpegError, IndexError, ValueError) as error:
        raise HandrailError(f"video {str(source)!r}: expected a whole mp4, got {error}") from error


def _copied(source: Path, first: int, count: int, target: Path, fps: int) -> bool:
    """Copy the packets of a stretch, if it stands on its own; return whether it did."""
    with av.open(str(source)) as container:
        stream = container.streams.video[0]
        packets = [packet for packet in container.demux(stream) if packet.size]
        places = [_place(packet, fps) for packet in packets]
        wanted = [place for place, number in enumerate(places) if first <= number < first + count]
        begin, end = wanted[0], wanted[-1] + 1
        if not packets[begin].is_keyframe or end - begin != count:
            return False
        shift = packets[begin].pts or 0
        with av.open(str(target), "w", format="mp4") as copy:
            out = copy.add_stream_from_template(stream)
            for packet in packets[begin:end]:
                packet.pts, packet.dts = (packet.pts or 0) - shift, (packet.dts or 0) - shift
                packet.stream = out
                copy.mux(packet)
    return True


def _encoded(source: Path, first: int, count: int, target: Path, fps: int, feature: Feature) -> None:
    encoder = VideoEncoder(target, fps, feature)
    try:
        with av.open(str(source)) as container:
            for frame in container.decode(video=0):
                if first <= _place(frame, fps) < first + count:
                    encoder.add(frame.to_ndarray(format="rgb24"))
    except BaseException:
        encoder.cancel()
        raise
    encoder.finish(count)


def _place(shown: Any, fps: int) -> int:
    """Return which picture of the video a packet or a frame is."""
    return round((shown.pts or 0) * shown.time_base * fps)
