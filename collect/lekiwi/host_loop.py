"""What LeKiwi's host does in every round: take the newest command, stop the base when none comes, answer."""

import json
import logging
import math
from collections import deque
from collections.abc import Iterable
from typing import Any

import numpy as np

from handrail.collect.lekiwi.body import LeKiwiBody
from handrail.collect.lekiwi.host_config import HostConfig
from handrail.collect.processor.units import number

EPISODE, SEED, SENT = "handrail.episode", "handrail.seed", "handrail.sent"  # a real host overlooks these
_WATCHDOG = 0.5  # without a command for so long the base stops, as LeRobot's host has it [s]
_PICTURES = 0.1  # from one to the next; in between it sends the last one again [s]
_QUALITY = 90  # of the JPEGs, as LeRobot's host has it


class Wire[Message]:
    """Hands messages on some time later, in order; loses some.

    Args:
        latency: how much later [s].
        drop: share of the messages that it loses, 0 to 1.
        rng: says which.

    Attributes:
        lost: how many.
    """

    def __init__(self, latency: float, drop: float, rng: np.random.Generator) -> None:
        self._latency, self._drop, self._rng = latency, drop, rng
        self._on_the_way: deque[tuple[float, Message]] = deque()
        self.lost = 0

    def put(self, message: Message, now: float) -> None:
        """Take a message."""
        if self._rng.random() < self._drop:
            self.lost += 1
        else:
            self._on_the_way.append((now + self._latency, message))

    def newest(self, now: float) -> Message | None:
        """Return the newest message that has arrived since the last time; those before it are forgotten."""
        message = None
        while self._on_the_way and self._on_the_way[0][0] <= now:
            _, message = self._on_the_way.popleft()
        return message


class LeKiwiLoop:
    """LeRobot's host loop, on a simulated robot and a network with faults.

    Args:
        body: the robot.
        config: of the host.
        start: now [s].

    Attributes:
        malformed: commands that made no sense.
        stops: of the base, by the watchdog.
        episodes: how each went.
    """

    def __init__(self, body: LeKiwiBody, config: HostConfig, start: float) -> None:
        self._body, self._config = body, config
        rng = np.random.default_rng(config.seed)
        self._commands: Wire[bytes] = Wire(config.latency, config.drop, rng)
        self._answers: Wire[list[bytes]] = Wire(config.latency, config.drop, rng)
        self._heard = self._began = start
        self._stopped, self._episode, self._newest = False, 0.0, b""
        self._pictures: dict[str, bytes] = {}
        self._painted = -math.inf
        self.malformed = self.stops = 0
        self.episodes: list[dict[str, Any]] = []
        self._times: list[float] = []  # of commands that were followed [s]
        self._ages: list[float] = []  # of those that say when they were sent [s]
        self._begin(config.seed)

    def tick(self, now: float, received: Iterable[bytes], wall: float = math.nan) -> list[bytes] | None:
        """Do one round; return the parts of the message to send, if one is due.

        Args:
            now: on a clock that advances [s].
            received: commands since the last round.
            wall: the time of day, on which commands say when they were sent [s].
        """
        for message in received:
            self._commands.put(message, now)
        if (message := self._commands.newest(now)) is not None:
            self._take(message, now, wall)
        if now - self._heard > _WATCHDOG and not self._stopped:
            self._stopped = True
            self.stops += 1
            self._body.stop_base()
        self._body.advance(now - self._began)
        body = self._body
        seen = {"success_at": body.done_at, "contacts": body.contacts, "seconds": body.time}
        self.episodes[-1] |= seen | {"base": body.base.round(4).tolist()}
        self._answers.put(self._answer(now), now)
        return self._answers.newest(now)

    def summary(self) -> dict[str, Any]:
        """Return what it saw; intervals and ages in [ms]."""
        gaps = np.diff(self._times)
        gaps = gaps[gaps < 0.5]  # within an episode
        return {
            "commands": len(self._times),
            "rate_hz": round(1.0 / float(np.mean(gaps)), 2) if len(gaps) else None,
            "interval_ms": _percentiles(gaps),
            "command_age_ms": _percentiles(np.array(self._ages)),
            "malformed": self.malformed,
            "messages_lost": self._commands.lost + self._answers.lost,
            "base_stops": self.stops,
            "base_speed": max(abs(v) for name, v in self._body.observation().items() if "vel" in name),
            "episodes": self.episodes,
        }

    def _take(self, message: bytes, now: float, wall: float) -> None:
        command = _parsed(message)
        if command is None or not _begins_well(command) or not self._body.take(command):
            if not self.malformed:
                logging.getLogger(__name__).warning("a command makes no sense: %s", message[:200])
            self.malformed += 1
            return
        if EPISODE in command and (episode := number(command, EPISODE)) != self._episode:
            self._episode, self._began = episode, now
            self._pictures.clear()
            self._begin(int(number(command, SEED)))
            self._body.take(command)
        self._heard, self._stopped = now, False
        if message == self._newest:  # said once more
            return
        self._newest = message
        self._times.append(now)
        if math.isfinite(age := wall - number(command, SENT)):
            self._ages.append(age)

    def _begin(self, seed: int) -> None:
        self._body.reset(seed)
        self.episodes.append({"seed": seed})

    def _answer(self, now: float) -> list[bytes]:
        """Return LeKiwi's observation: a header, and a JPEG a camera; of a lost one nothing."""
        cameras = self._config.camera_names
        if cameras and now - self._painted >= _PICTURES:
            self._painted = now
            lost = self._config.lost_camera
            self._pictures = {name: b"" if name == lost else _jpeg(self._body, name) for name in cameras}
        header = {"_cams": list(cameras), EPISODE: self._episode, **self._body.observation()}
        return [json.dumps(header).encode(), *(self._pictures.get(name, b"") for name in cameras)]


def _begins_well(command: dict[str, Any]) -> bool:
    """Return whether a command asks for no episode, or for one that there can be."""
    episode, seed = number(command, EPISODE), number(command, SEED)
    return EPISODE not in command or (math.isfinite(episode) and 0.0 <= seed < 2.0**53)


def _percentiles(seconds: np.ndarray) -> dict[str, float] | None:
    if not len(seconds):
        return None
    return {f"p{p}": round(1e3 * float(np.percentile(seconds, p)), 1) for p in (50, 95, 100)}


def _parsed(message: bytes) -> dict[str, Any] | None:
    try:
        command = json.loads(message)
    except (ValueError, RecursionError):
        return None
    return command if isinstance(command, dict) else None


def _jpeg(body: LeKiwiBody, camera: str) -> bytes:
    import cv2

    picture = body.picture(camera)  # RGB, though OpenCV takes it for BGR: LeRobot's host does so, too
    done, coded = cv2.imencode(".jpg", picture, [int(cv2.IMWRITE_JPEG_QUALITY), _QUALITY])
    return coded.tobytes() if done else b""
