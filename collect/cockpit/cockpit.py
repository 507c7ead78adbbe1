"""The cockpit as the recording sees it: an operator that steers, an observer that shows.

The page's server is a process of its own. The recording takes the newest input when it needs one, and never
waits: what the server does not take at once is dropped. When the loop is late, pictures come less often.
"""

import io
import math
import sys
import time
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from PIL import Image

from handrail.collect.cockpit import stage
from handrail.collect.cockpit.episodes import DiskRoom, EpisodeList, EpisodePoses
from handrail.collect.cockpit.pipe import Kind
from handrail.collect.cockpit.process import ServerProcess, open_server
from handrail.collect.cockpit.snapshot import Snapshots
from handrail.collect.cockpit.strain import Strain
from handrail.collect.commands.account import next_commands
from handrail.collect.config import RecordConfig
from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.operators.person.inputs import Ask, Input
from handrail.collect.operators.person.person import Person, Phase
from handrail.collect.session.build import build_modes
from handrail.collect.session.outcome import Outcome
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.errors import HandrailError, check_installed
from handrail.controllers.interface.intent import Intent
from handrail.datasets.recording.frames import Frame

NEEDED = "the cockpit", ("uvicorn", "starlette", "websockets", "cryptography"), "cockpit"
_JPEG_QUALITY = 70
_PICTURE_SIDE = 320  # of a live picture at most; the recorded one is as large as it is [px]


class Cockpit:
    """A person at a browser; an operator and an observer.

    Args:
        person: whoever steers.
        server: the page's.
        refuses: what the page may not ask for, of `ASKS`.
        say: is told at the end what was dropped.
        config: of the recording whose folder and progress the page shows; None where it shows none.

    Attributes:
        person: whoever steers.
        trouble: why the recording ended early; the page says it at the end.
    """

    def __init__(
        self,
        person: Person,
        server: ServerProcess,
        refuses: Collection[str] = (),
        say: Callable[[str], None] = lambda words: None,
        config: RecordConfig | None = None,
    ) -> None:
        self.person, self._server, self._refuses, self._say = person, server, refuses, say
        self.trouble = ""
        self._folder = str(config.dataset.folder) if config else ""
        self._next = next_commands(Path(self._folder)) if self._folder else []
        self._wanted = config.dataset.num_episodes if config else 0
        self._shared = bool(config and config.policy)
        self._episodes, self._strain = EpisodeList(server), Strain()
        self._disk = DiskRoom(Path(self._folder).absolute()) if self._folder else None
        Image.preinit()  # else the first picture of an episode waits for that
        self._dropped: dict[str, int] = {}
        self._pictured = self._acted = -math.inf
        self._delay = 0.0  # of the last command, from when it was asked for [s]

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Show the scene of a new episode."""
        self._env, self._snapshots = env, Snapshots(env, self._shared)
        self._acted, self._delay = -math.inf, 0.0
        self._poses = EpisodePoses(env.simulation.mujoco_model)
        self._send_stage()

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode: the robot waits for the operator; what was asked of the one before is over."""
        self.person.over()
        self._listen()
        self.person.reset(view, rng)

    def act(self, view: View) -> Intent | EpisodeEvent:
        """Return the intent now, or what becomes of the episode; let the page have this moment."""
        now = time.monotonic()
        if now < self._acted + 1.0:  # else an undo, or a new episode
            self._strain.note(now - self._acted - self._env.period)
        self._listen()
        answer = self.person.act(view)
        if self.person.phase is not Phase.DRIVING:  # there may be no frame to see
            self._picture(view.observation.get("pixels", {}))
        moment = self._snapshots.now(view, self.person, now) | {
            "saved": self._episodes.saved,
            "succeeded": self._episodes.succeeded,
            "commanded": round(self._acted + self._delay, 4) if self._delay else 0.0,
            "dropped": self._all_dropped,
            "disk": self._disk.left if self._disk else (-1, -1),
        }
        self._server.pipe.send(Kind.FRAME, moment)
        self._acted, self._delay = now, 0.0
        return answer

    def see(self, frame: Frame) -> None:
        """Show how the controller fared, and what the cameras see."""
        self._snapshots.see(frame)
        self._delay = frame.commanded - frame.wall_clock
        self._poses.see(frame.number, self._env.simulation.data)
        self._picture(frame.images)

    def end(self, outcome: Outcome) -> None:
        """Count an episode; keep its poses, if it is kept."""
        self._episodes.add(outcome, self._poses)
        if self._disk:
            self._disk.measure(self._episodes.saved)
        self._send_stage()

    def close(self) -> None:
        """Say on the page that it is over, and here what was dropped; end the server."""
        with suppress(HandrailError):
            self._listen()
        if self._all_dropped:
            counts = ", ".join(f"{count} {why}" for why, count in self._all_dropped.items())
            self._say(f"dropped or refused by the page's server: {counts}")
        over = {"saved": self._episodes.saved, "folder": self._folder, "next": self._next}
        trouble = self.trouble or str(sys.exception() or "")  # an error of the program, too
        self._server.pipe.send_surely(Kind.OVER, over | {"trouble": trouble})
        self._server.close()

    @property
    def _all_dropped(self) -> dict[str, int]:
        """Messages dropped or refused on the way to pages and back, counted by reason."""
        kinds, ours = {"frames": Kind.FRAME, "pictures": Kind.PICTURE}, self._server.pipe.dropped
        return self._dropped | {
            f"{what} without room": ours[kind] for what, kind in kinds.items() if ours[kind]
        }

    def _picture(self, images: Mapping[str, np.ndarray]) -> None:
        """Show what the cameras see, unless that was just now."""
        if images and time.monotonic() > self._pictured + 0.9 * self._strain.picture_period:
            self._pictured = time.monotonic()
            for index, picture in enumerate(images.values()):
                self._server.pipe.send(Kind.PICTURE, bytes([index]) + _jpeg(picture))

    def _listen(self) -> None:
        """Take what the server has passed on."""
        for kind, value in self._server.receive():
            match kind:
                case Kind.LOST:
                    self.person.lose()
                case Kind.STOP:
                    self.person.ask(Ask("stop"))
                case Kind.NOTE:
                    self._send_stage()
                case Kind.DROPPED:
                    self._dropped = value
                case Kind.DRIVE:
                    inputs, received, round_trip = value
                    self.person.take(msgspec.convert(inputs, Input), received, round_trip)
                case Kind.ASK | Kind.STILL if value["what"] not in self._refuses:
                    self.person.ask(Ask(**value))

    def _send_stage(self) -> None:
        """Say what there is to draw and to choose from."""
        env, robot, person = self._env, self._env.model.description, self.person
        compiled, channels = env.simulation.mujoco_model, person.meaning.channels
        digest, data = stage.meshes(compiled)
        self._server.keep(f"{digest}.bin", data)
        said: dict[str, Any] = {
            "shapes": stage.shapes(compiled),
            "meshes": digest,
            "task": env.task.description,
            "time_limit": env.task.time_limit,
            "robot": robot.name,
            "channels": channels.names,
            "joints": env.model.joints,
            "lower": [_known(x) for x in robot.limits.position_lower],
            "upper": [_known(x) for x in robot.limits.position_upper],
            "base": len(channels.base),
            "modes": [
                {"name": mode.name, "help": mode.help, "focus": mode.by_focus}
                for mode in person.modes.values()
            ],
            "refuses": sorted(self._refuses),
            "cameras": env.cameras,
            "gripper": any(hand.gripper for hand in robot.hands),
            "grips": bool(env.start.scene.movables),
            "episodes": self._episodes.described(),
            "folder": self._folder,
            "wanted": self._wanted,
            "hands": [
                {
                    "name": hand.name,
                    "bodies": stage.hand(compiled, hand),
                    "joints": np.flatnonzero(channels.moving(number)).tolist(),  # that move it
                }
                for number, hand in enumerate(robot.hands)
            ],
            "scale": robot.world.scale,
            "base_size": robot.base.size if len(channels.base) else (),
        }
        said |= {"policy": True} if self._shared else {}
        self._server.pipe.send_surely(Kind.STAGE, said, (Kind.STAGE,))


def open_cockpit(config: RecordConfig, env: HandrailEnv, say: Callable[[str], None]) -> Cockpit:
    """Return the cockpit of a recording, and say where it is."""
    check_installed(*NEEDED)
    person = Person(env.model, build_modes(config, env), config.mode_name, supervises=bool(config.policy))
    server = open_server(config.cockpit, say)
    say(f"Episodes go to {config.dataset.folder}. To end: End recording on the page, or Ctrl-C here.")
    # what has moved does not go back by itself; a policy moves every joint
    refuses = [ask for ask, no in (("undo", env.real), ("lock", config.policy)) if no]
    return Cockpit(person, server, refuses, say, config)


def _known(limit: float) -> float | None:
    return round(float(limit), 3) if math.isfinite(limit) and abs(limit) < 100.0 else None


def _jpeg(picture: np.ndarray) -> bytes:
    step = -(-max(picture.shape) // _PICTURE_SIDE)
    picture, stream = np.ascontiguousarray(picture[::step, ::step]), io.BytesIO()
    Image.fromarray(picture).save(stream, format="jpeg", quality=_JPEG_QUALITY)
    return stream.getvalue()
