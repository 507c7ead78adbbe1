"""Films a page while somebody drives, and makes a small moving picture of it."""

import base64
import io
import time

from PIL import Image


class PageFilm:
    """Takes the pictures that the browser draws, not more often than said.

    Args:
        page: Playwright's.
        period: between two pictures [s].
        width: of the pictures [px].
    """

    def __init__(self, page, period, width):
        self.frames = []
        self._period, self._next, self._page = period, 0.0, page
        self._session = page.context.new_cdp_session(page)
        self._session.on("Page.screencastFrame", self._take)
        look = {"format": "jpeg", "quality": 85, "maxWidth": width, "everyNthFrame": 4}
        self._session.send("Page.startScreencast", look)

    def stop(self):
        self._session.send("Page.stopScreencast")

    def save(self, path, width, duration):
        """Write a moving picture of a duration [s]; the last frame stays a little."""
        shown = [_smaller(frame, width) for frame in self.frames]
        times = [round(1000 * duration / len(shown))] * (len(shown) - 1) + [1200]
        first, *others = shown
        first.save(path, save_all=True, append_images=others, duration=times, loop=0, quality=50, method=4)

    def _take(self, event):
        if time.monotonic() >= self._next:
            self._next = time.monotonic() + self._period
            self.frames.append(base64.b64decode(event["data"]))
        self._session.send("Page.screencastFrameAck", {"sessionId": event["sessionId"]})


def _smaller(data, width):
    picture = Image.open(io.BytesIO(data)).convert("RGB")
    return picture.resize((width, round(width * picture.height / picture.width)), Image.Resampling.LANCZOS)
