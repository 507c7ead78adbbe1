"""Recordings of a policy beside a person: both scripted, so that who owned what is known frame by frame."""

from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from handrail.collect.commands.recording import session_columns
from handrail.collect.config import RecordConfig, SessionConfig
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.operators.shared.arbiter import Groups
from handrail.collect.operators.shared.by_input import ByMask
from handrail.collect.operators.shared.settings import ArbiterSettings
from handrail.collect.operators.shared.shared_operator import SharedOperator
from handrail.collect.session.build import build_controller, build_env, build_mode, session_features
from handrail.collect.session.recorder import Recorder
from handrail.collect.session.session import Session
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent, RawInput
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.recording.writer import EpisodeWriter

FPS, FRAMES = 20, 36
HANDBACK = 0.12  # s: the moment of the last input, and two more
HAND, BASE = range(6, 10), range(16, 18)  # frames in which the person moves them
CLOSES, NONE, PAUSED = 30, range(24, 27), range(20, 22)  # the gripper; no usable answer; the person says wait
CONFIG = SessionConfig(task="reach", physics=False, time_limit=FRAMES / FPS, seed=3)


@dataclass
class Person:
    """Moves the hand, then the base, says wait, closes the gripper."""

    channels: Channels

    def reset(self, view, rng):
        self.frame = -1

    def act(self, view):
        self.frame += 1
        if self.frame in PAUSED:
            return EpisodeEvent.PAUSE
        values = np.zeros(self.channels.size)
        values[self.channels.names.index("ee.vz")] = 0.1 * (self.frame in HAND)
        values[self.channels.names.index("base.vx")] = 0.1 * (self.frame in BASE)
        mask = self.channels.mask("base", "ee")
        raw = RawInput(axes=int(np.count_nonzero(values)), device="stick")
        closes = (float(self.frame >= CLOSES),)
        return Intent(values, mask, closes, "ee", view.state.time, raw=raw)


@dataclass
class Policy:
    """Wants one thing throughout; now and then it has no usable answer."""

    channels: Channels
    doubt = 0.0

    def reset(self, view, rng):
        self.calls = 0

    def replan(self):
        pass

    def chunk(self):
        return []

    def act(self, view):
        frame = round(view.state.time * FPS)
        values = np.where(np.arange(self.channels.size) == self.channels.names.index("ee.vx"), 0.05, 0.0)
        raw = RawInput(age=0.01 * frame)
        mask = self.channels.mask("ee")
        values = np.where(frame in NONE, np.nan, values)
        return Intent(values, mask, (0.25,), time=view.state.time, raw=raw)


def record_takeovers(root: Path, episodes: int = 2, physics: bool = False, shared: bool = True) -> None:
    """Record episodes of a person beside a policy; without the columns that say so if not `shared`."""
    config = replace(CONFIG, physics=physics)
    with closing(build_env(config, FPS)) as env:
        mode, channels = build_mode(config, env.model), Channels.of(env.model.description)
        arbiter = ByMask(Groups(channels), ArbiterSettings(handback=HANDBACK))
        operator = SharedOperator(Person(channels), Policy(channels), arbiter, env.model)
        recorder = Recorder("reach", session_columns(RecordConfig(**vars(config))))
        controller = build_controller(mode, env.model, FPS, config.task)
        session = Session(env, controller, operator, [recorder])
        features = session_features(env, shared)
        manifest = Manifest("handrail/set", FPS, env.model.description.name, features)
        with EpisodeWriter.create(root, manifest) as recorder.writer:
            for seed in range(episodes):
                recorder.end(session.run(seed))


def expected_owners(names: tuple[str, ...]) -> np.ndarray:
    """Return who commanded what in each frame, (T, m + h), from what both were scripted to do."""
    owners = np.zeros((FRAMES, len(names)), int)
    ee, base = (np.array([name.startswith(group) for name in names]) for group in ("ee.", "base."))
    gripper = np.array(names) == "gripper"
    for frame in range(FRAMES):
        if frame in PAUSED:
            continue
        answers = frame not in NONE
        hand = HAND.start <= frame < HAND.stop + 2
        owners[frame, ee] = 2 if hand else answers
        owners[frame, base] = 2 * (BASE.start <= frame < BASE.stop + 2)
        owners[frame, gripper] = 2 if hand or frame >= CLOSES else answers
    return owners
