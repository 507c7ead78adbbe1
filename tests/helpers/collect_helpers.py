"""Shared by the tests of collect/: environments that are closed, poses that are reached, a second robot."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from places import ROOT
from scipy.spatial.transform import Rotation

import handrail.collect  # noqa: F401  (registers the environments)
from handrail.collect.config import SessionConfig
from handrail.collect.operators.operator import View
from handrail.collect.session.build import build_env, build_session, session_features
from handrail.collect.session.outcome import Outcome
from handrail.collect.session.recorder import Recorder
from handrail.collect.session.session import Observer
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.scene import Scene, SceneObject
from handrail.collect.world.task import Start
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import RobotModel, load_model
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.recording.frames import Frame
from handrail.datasets.recording.writer import EpisodeWriter

UP = np.array([0.0, 0.0, 1.0])
DOWN = np.diag([1.0, -1.0, -1.0])  # tool pointing at the floor


class Watcher:
    """Keeps the frames of an episode; an observer."""

    def begin(self, env: HandrailEnv, seed: int) -> None:
        self.frames: list[Frame] = []

    def see(self, frame: Frame) -> None:
        self.frames.append(frame)


class Motionless:
    """An operator who asks for nothing, and notes what they see."""

    def reset(self, view: View, rng: np.random.Generator) -> None:
        self.seen: list[View] = []

    def act(self, view: View) -> Intent:
        self.seen.append(view)
        return Intent.idle(Channels.of(load_model().description), time=view.state.time)


def episode(seed: int, *observers: Observer, **settings: Any) -> Outcome:
    """Run one episode of a session with some settings; return how it went."""
    config = SessionConfig(**settings)
    with closing(build_env(config, 20)) as env:
        return build_session(config, env, observers).run(seed)


@contextmanager
def environment(name: str = "PickPlace", **options: Any) -> Iterator[HandrailEnv]:
    env = gymnasium.make(f"handrail/{name}-v0", **options).unwrapped
    assert isinstance(env, HandrailEnv)
    try:
        yield env
    finally:
        env.close()


@contextmanager
def recording(root: Path, env: HandrailEnv) -> Iterator[Recorder]:
    """Record the episodes of a session into a new dataset."""
    with EpisodeWriter.create(root, Manifest("x/set", 20, "robot", session_features(env))) as writer:
        recorder = Recorder("reach", {})
        recorder.writer = writer
        yield recorder


def action(env: HandrailEnv, velocity: Any = 0.0, gripper: float = 0.0) -> np.ndarray:
    grippers = [gripper] * len(env.model.description.hands)
    return np.append(np.zeros(env.model.size) + velocity, grippers).astype(np.float32)


def hold(env: HandrailEnv, steps: int, gripper: float = 0.0, velocity: Any = 0.0) -> dict:
    """Ask for the same again and again until the episode is over; return what was said last."""
    info = {}
    for _ in range(steps):
        *_, terminated, _, info = env.step(action(env, velocity, gripper))
        if terminated:
            break
    return info


def reach(model: RobotModel, q: np.ndarray, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Move the arm's joints until the tool is there."""
    q, arm = q.copy(), slice(len(model.description.base.joints), model.size)
    for _ in range(300):
        pose = model.pose(q)
        turn = Rotation.from_matrix(rotation @ pose.rotation.T).as_rotvec()
        error = np.concatenate([position - pose.position, turn])
        J = model.jacobian(q)[:, arm]
        q[arm] += np.clip(J.T @ np.linalg.solve(J @ J.T + 1e-4 * np.eye(6), error), -0.1, 0.1)
    assert np.abs(error).max() < 1e-6
    return q


def over_cube(env: HandrailEnv, seed: int, height: float) -> Start:
    """Return the seed's episode with the open gripper `height` above the cube's centre, pointing down."""
    env.reset(seed=seed)
    state = env.task_state()
    cube = state.pose("cube")
    q = np.array([cube.position[0] - 1.05, cube.position[1], 0.0, 1.57, -1.2, 1.8, -2.2, -1.57, 0.0])
    q = reach(env.model, q, cube.position + height * UP, cube.rotation @ DOWN)
    return Start(state.start.scene, q)


def moved(episode: Start, name: str, position: Any) -> Start:
    """Return the episode with an object somewhere else."""

    def move(item: SceneObject) -> SceneObject:
        return replace(item, position=np.array(position), rotation=np.eye(3)) if item.name == name else item

    scene = Scene(tuple(move(item) for item in episode.scene.objects), episode.scene.view)
    return Start(scene, episode.q, episode.goal)


SMALL_ROBOT = (ROOT / "tests" / "data" / "small_ur5.toml").read_text()


def write_small_robot(folder: Path) -> Path:
    path = folder / "small_ur5.toml"
    path.write_text(SMALL_ROBOT)
    return path
