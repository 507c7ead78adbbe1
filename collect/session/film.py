"""The video of an episode: the scene camera's pictures with a caption."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from handrail.collect.envs.env import HandrailEnv
from handrail.collect.session.video_file import VideoFile
from handrail.datasets.recording.frames import Frame

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
        self._large, self._small = (ImageFont.load_default(size) for size in (20, 16))

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note of the environment."""
        self._env = env

    def see(self, frame: Frame) -> None:
        """Add the picture of this moment."""
        picture = self._env.render()
        if picture is not None:
            self.add(self._captioned(picture, frame))

    def _captioned(self, picture: NDArray[np.uint8], frame: Frame) -> NDArray[np.uint8]:
        """Return the picture on top of a bar with the caption."""
        height, width = picture.shape[:2]
        image = Image.new("RGB", (width, height + _BAR), (24, 26, 30))
        image.paste(Image.fromarray(picture))
        draw = ImageDraw.Draw(image)
        draw.text((16, height + 9), self._title, font=self._large, fill=(245, 245, 245))
        words = self._words(frame)
        draw.text((16, height + 37), words, font=self._small, fill=(190, 195, 205))
        return np.array(image)
