"""The video of an episode: the scene camera's pictures with a caption."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from handrail.collect.session.video_file import VideoFile
from handrail.collect.world.envs.env import HandrailEnv
from handrail.datasets.recording.frames import Frame

_font = cache(ImageFont.load_default)
SIZE = (540, 960)  # height, width [px]
_BAR = 64  # height of the caption [px]; both even, as h264 wants


class Filmer(VideoFile):
    """Adds one picture a control period to a file; an observer.

    The environment renders pictures of `SIZE`.

    Args:
        path: of the file, .mp4.
        fps: pictures a second.
        title: first line of the caption.
        words: second line, at a moment.
    """

    def __init__(self, path: Path, fps: int, title: str, words: Callable[[Frame], str]) -> None:
        super().__init__(path, (SIZE[0] + _BAR, SIZE[1]), fps)
        self._title, self._words = title, words

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note of the environment."""
        self._env = env

    def see(self, frame: Frame) -> None:
        """Add the picture of this moment."""
        picture = self._env.render()
        if picture is not None:
            self.add(captioned(picture, _BAR, (self._title, 9, 20), (self._words(frame), 37, 16)))


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
