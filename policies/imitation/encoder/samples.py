"""Samples that an encoder learns from: pictures, the robot's state, and the truth that it shall say.

They are drawn, never stored. Of a chunk,

- some are moments of episodes that a script drives, in several teleop modes: also with the cube in hand,
- some the same moments with the robot moved, a little or much: so that it is not always on its way, and near
  things with its hand turned otherwise,
- some are scenes of other episodes, seen by the robot where it was in these, for these cost no driving,
- some of these with the robot astray, so that it knows how little it sees there.

A part of the chunks has other light, colours and camera poses each time.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from handrail.collect.operators.modes import MODES
from handrail.collect.seeds import encoder_seed
from handrail.collect.session.build import build_env, build_session, session_features
from handrail.collect.session.session import Session
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.observation import AgentObservation
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import check_known
from handrail.datasets.recording.frames import Frame
from handrail.policies.imitation.encoder.config import EncoderConfig
from handrail.policies.imitation.interface.encoder import Reads
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.views import CameraMount

FPS = 20
_DRIVEN = ("ee", "direct")  # modes of the scripts
_EPISODES = 3  # of a chunk
_OWN, _MOVED = 36, 60  # of an episode that takes all the time that its task gives
_POSES = 5  # at which a scene is seen
_FARTHEST = 0.5  # standard deviation by which the robot is moved at most [m · scale/2, rad]
_RANDOMISED = 4  # every so-many-th chunk
Samples = dict[str, np.ndarray]
START, DRIVEN, OTHER = range(3)
"""The kind of moment of a sample, in `kind`: START and DRIVEN are as a policy sees them."""


@dataclass
class Drawn:
    """Chunks of samples, each from its number alone: a dataset as PyTorch has them."""

    config: EncoderConfig

    def __getitem__(self, chunk: int) -> Samples:
        """Return a chunk: pictures by camera, `views`, `state`, `environment`, `kind`; (N, …) each.

        `views` is where each camera is, and the slope of its field of view: c, R, s, (cameras, 13).
        """
        rng = np.random.default_rng([self.config.seed, chunk])
        seeds = (encoder_seed(self.config.seed, chunk, number) for number in range(2**32))
        randomised = chunk % _RANDOMISED == _RANDOMISED - 1
        env, sessions = self._randomised if randomised else self._plain
        watcher = _Watcher(env, self.config.session.camera_names, rng)
        for seed in (next(seeds) for _ in range(_EPISODES)):
            session = sessions[rng.integers(len(sessions))]
            replace(session, observers=(watcher,)).run(seed)
        own = len(watcher.rows)
        while len(watcher.rows) < 2 * own:
            env.reset(seed=next(seeds))
            watcher.take(START)
            for number in range(_POSES - 1):
                q = watcher.been[rng.integers(len(watcher.been))]
                env.simulation.show(watcher.moved(q) if number % 2 else q)
                watcher.take(OTHER)
        samples = {name: np.stack([row[name] for row in watcher.rows]) for name in watcher.rows[0]}
        if randomised:
            samples["kind"][:] = OTHER
        return samples

    def __len__(self) -> int:
        return 2**31

    @cached_property
    def reads(self) -> Reads:
        """The inputs and outputs of an encoder of these."""
        env, _ = self._plain
        features = session_features(env)
        interface = PolicyInterface.of_dataset(features, (), "realised")
        env.reset(seed=0)
        turns = {item.name: item.turns for item in env.start.scene.objects if item.turns > 1}
        movable = tuple(item.name for item in env.start.scene.objects if item.movable)
        movable += tuple(part for part, whole in env.task.parts.items() if whole in movable)
        known = {each.name: each for each in env.model.description.cameras}
        check_known("camera of the robot", names := self.config.session.camera_names, known)
        env.pictures(names)  # without OpenGL the error is one line here, not in a worker
        cameras = {name: CameraMount.of(known[name], env.model, env.image_size) for name in names}
        return Reads(env.model.description.name, self.config.task, cameras, interface, turns, movable)

    @cached_property
    def _plain(self) -> tuple[HandrailEnv, list[Session]]:
        return self._built(randomise=False)

    @cached_property
    def _randomised(self) -> tuple[HandrailEnv, list[Session]]:
        return self._built(randomise=True)

    def _built(self, randomise: bool) -> tuple[HandrailEnv, list[Session]]:
        """Return an environment that draws only the moments that are asked for, and its sessions."""
        config = replace(self.config.session, cameras="", randomise=randomise)
        env = build_env(config, FPS, render=True)
        return env, [build_session(replace(config, mode=mode), env) for mode in _DRIVEN if mode in MODES]


class _Watcher:
    """Takes samples while episodes run.

    Attributes:
        rows: of the samples.
        been: positions of the joints of all moments, (n,) each.
    """

    def __init__(self, env: HandrailEnv, cameras: tuple[str, ...], rng: np.random.Generator) -> None:
        self._env, self._cameras, self._rng = env, cameras, rng
        self._frames = env.task.time_limit * env.fps
        self._agent = AgentObservation(env.model)
        self.rows: list[Samples] = []
        self.been: list[FloatArray] = []

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take the moment at which an episode begins."""
        self.take(START)

    def see(self, frame: Frame) -> None:
        """Take some of the moments."""
        simulation = self._env.simulation
        q, number = simulation.state().q.copy(), self._frames * self._rng.random()
        self.been.append(q)
        if number < _OWN:
            self.take(DRIVEN)
        elif number < _OWN + _MOVED and not simulation.held():
            before = simulation.checkpoint()
            simulation.show(self.moved(q))
            self.take(OTHER)
            simulation.restore(before)

    def take(self, kind: int) -> None:
        """Take this moment."""
        env = self._env
        truth = env.task_state()
        state = self._agent.read(env.state(), truth.tools, truth.openings)
        around = np.asarray(env.task.features(truth), np.float32)
        cameras = map(env.simulation.camera, self._cameras)
        views = [(*at.position, *at.rotation.ravel(), np.tan(np.deg2rad(fovy) / 2)) for at, fovy in cameras]
        numbers = {"state": state, "environment": around, "kind": np.array(kind), "views": np.array(views)}
        self.rows.append(env.pictures(self._cameras) | numbers)

    def moved(self, q: FloatArray) -> FloatArray:
        """Return positions of the joints near others or far from them, (n,), inside the limits."""
        description = self._env.model.description
        away = np.full(len(q), self._rng.uniform(0.0, _FARTHEST))
        away[:2] *= 0.5 * description.world.scale
        limits = description.limits
        moved = q + away * self._rng.normal(size=len(q))
        return np.clip(moved, limits.position_lower, limits.position_upper)


def batches(chunks: Iterator[Samples], size: int, reuse: float, most: int, seed: int) -> Iterator[Samples]:
    """Yield samples in random order, from those drawn lately.

    Args:
        chunks: of samples.
        size: of a batch.
        reuse: how often a sample comes, on average.
        most: samples that are kept.
        seed: of the order.
    """
    kept: deque[Samples] = deque()
    owed = 0.0
    for number, chunk in enumerate(chunks):
        kept.append(chunk)
        while sum(map(_count, kept)) - _count(kept[0]) >= most:
            kept.popleft()
        ends = np.cumsum([_count(each) for each in kept])
        rng = np.random.default_rng([seed, number])
        owed += reuse * _count(chunk) / size
        while owed >= 1.0:
            owed -= 1.0
            places = rng.integers(ends[-1], size=size)
            chosen = [
                (kept[which], place - ends[which])
                for which, place in zip(np.searchsorted(ends, places, "right"), places, strict=True)
            ]
            yield {name: np.stack([each[name][row] for each, row in chosen]) for name in chunk}


def _count(samples: Samples) -> int:
    return len(samples["kind"])
