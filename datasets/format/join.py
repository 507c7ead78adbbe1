"""Joining stretches of mp4s into one: packets are copied with new times, no picture is encoded anew.

A stretch can be copied if it begins with a key frame and no picture in it needs one that is left out; it can
be joined to another if both are encoded alike, since a file describes its pictures once.
"""

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.controllers.regular_file import regular
from handrail.datasets.format.video import place_of, sought, whole_mp4

_TOLERANCE = 1e-4  # LeRobot's `tolerance_s` [s]


@dataclass(frozen=True)
class Stretch:
    """Packets that stand on their own."""

    packets: list[Any]
    """In the order in which they are decoded."""
    stream: Any
    """The video that they are of, open."""
    first: int
    """The picture of it that is shown first."""
    count: int
    """Number of pictures."""


class Videos:
    """Reads stretches of mp4s and keeps the last one of each camera open: episodes are read in order."""

    def __init__(self, fps: int):
        """Begin without an open file; pictures a second `fps` [Hz] of all of them."""
        self._fps = fps
        self._open: dict[str, tuple[Path, Any]] = {}

    def stretch(self, path: Path, first: int, count: int, camera: str) -> Stretch | None:
        """Return some pictures of a video; None if they cannot be copied.

        Args:
            path: An mp4.
            first: The picture that it begins with.
            count: Number of pictures.
            camera: The camera; its last video stays open until the next.
        """
        with whole_mp4(path):
            if camera not in self._open or self._open[camera][0] != path:
                self.forget(camera)
                self._open[camera] = path, av.open(str(regular(path)))
            container = self._open[camera][1]
            stream = sought(container, first, self._fps)
            packets: list[Any] = []
            for packet in container.demux(stream):
                place = place_of(packet, self._fps) if packet.size else first + count
                if first <= place < first + count:
                    packets.append(packet)
                elif packets and packet.size:
                    return None  # a picture in between is decoded with others
                if len(packets) == count:
                    return Stretch(packets, stream, first, count) if packets[0].is_keyframe else None
        raise HandrailError(
            f"video {str(path)!r}: expected the pictures {first} to {first + count - 1}, got fewer"
        )

    def forget(self, camera: str) -> None:
        """Close the video of a camera, if one is open."""
        if camera in self._open:
            self._open.pop(camera)[1].close()

    def close(self) -> None:
        """Close what is open."""
        for camera in tuple(self._open):
            self.forget(camera)


class VideoJoin:
    """One mp4 that grows by stretches of others."""

    def __init__(self, target: Path, fps: int):
        """Begin a video at `fps` [Hz]; the file appears with the first stretch."""
        self.target, self._fps = target, fps
        self._container: Any = None
        self._out: Any = None
        self._like: tuple = ()
        self._pictures = self.size = 0

    def fits(self, stretch: Stretch) -> bool:
        """Return whether a stretch is encoded as what is there, and is found after it."""
        alike = self._container is None or self._like == _encoding(stretch.stream)
        return alike and are_found(self._pictures, stretch.count, self._fps)

    def add(self, stretch: Stretch) -> None:
        """Append a stretch that fits."""
        if self._container is None:
            self._container = av.open(str(self.target), "w", format="mp4")
            self._out = self._container.add_stream_from_template(stretch.stream, opaque=True)
            self._like = _encoding(stretch.stream)
        base = stretch.stream.time_base
        shift = round(Fraction(self._pictures - stretch.first, self._fps) / base)
        for packet in stretch.packets:
            packet.pts, packet.dts = (packet.pts or 0) + shift, (packet.dts or 0) + shift
            packet.stream = self._out
            self.size += packet.size
            self._container.mux(packet)
        self._pictures += stretch.count

    def close(self) -> None:
        """Finish the file; safe to call twice."""
        if self._container is not None:
            self._container.close()
        self._container = None


def are_found(first: int, count: int, fps: int) -> bool:
    """Return whether LeRobot finds pictures in a video by their times, which it rounds to float32.

    Args:
        first: The picture that an episode begins with.
        count: Number of its pictures.
        fps: Pictures a second [Hz].
    """
    asked = np.float32(first / fps + np.float32(np.arange(count) / fps).astype(float))
    shown = np.float32(np.arange(first, first + count) / fps)
    return bool((np.abs(asked - shown) < _TOLERANCE).all())


def _encoding(stream: Any) -> tuple:
    """Return what two videos must have in common to be one file."""
    codec = stream.codec_context
    return codec.name, codec.width, codec.height, codec.pix_fmt, codec.extradata, stream.time_base
