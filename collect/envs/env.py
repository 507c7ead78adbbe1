"""The Gymnasium environment: a robot, a task, velocities in, observations out."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import load_env_creator
from numpy.typing import ArrayLike, NDArray

from handrail.collect.envs.observation import AgentObservation, bounded, box_space, image_space
from handrail.collect.simulation.rendering import CAMERAS, FAST, PRETTY, Painter
from handrail.collect.simulation.simulation import Simulation
from handrail.collect.tasks.task import Episode, Outcome, Task, TaskState
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError, unknown_name
from handrail.controllers.interface.controller import State
from handrail.controllers.robot.model import RobotModel, load_model
from handrail.controllers.robot.shape import Obstacle
from handrail.controllers.safety.limiter import Limiter

Observation = dict[str, Any]
RENDER_SIZE = (480, 640)  # height, width [px]


class HandrailEnv(gymnasium.Env[Observation, NDArray[np.float32]]):
    """A robot does a task.

    Action, (n + 1,) float32: the generalised velocities that the robot shall have at the end of the step
    [m/s, rad/s], reached linearly from those commanded before, and the gripper (0 open, 1 closed). Every
    action passes the `Limiter`; one that is not finite brakes.

    Args:
        task: a `Task`, or the name of its class as `module:Class`.
        robot: name of a robot, or its description file.
        fps: steps a second, 10 to 100.
        cameras: which of `wrist`, `scene` to show as `pixels`.
        image_size: height and width of `pixels` [px].
        render_mode: `rgb_array` or None.
        render_size: height and width of what `render` returns [px].

    Attributes:
        task: what is to be done.
        model: kinematics of the robot.
        fps: steps a second.
        agent_names: names of the numbers in `agent_pos`.
        state_names: names of the numbers in `environment_state`.

    Raises:
        HandrailError: fps, cameras or render mode are none of those.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012  (Gymnasium's name)

    def __init__(
        self,
        task: Task | str,
        robot: str | Path = "ridgeback_ur10",
        *,
        fps: int = 20,
        cameras: Sequence[str] = (),
        image_size: tuple[int, int] = (128, 128),
        render_mode: str | None = None,
        render_size: tuple[int, int] = RENDER_SIZE,
    ) -> None:
        _check(fps, cameras, render_mode)
        self.task: Task = load_env_creator(task)() if isinstance(task, str) else task  # pyright: ignore
        self.model: RobotModel = load_model(robot)
        self.fps = fps
        self.cameras = tuple(cameras)
        self.image_size = (int(image_size[0]), int(image_size[1]))
        self.render_mode = render_mode
        self.render_size = (int(render_size[0]), int(render_size[1]))
        self.metadata = {**type(self).metadata, "render_fps": fps}
        self._max_episode_steps = math.ceil(self.task.horizon * fps)
        self._limiter = Limiter(self.model.description)
        self._agent = AgentObservation(self.model)
        self.agent_names = self._agent.names
        self.state_names = self.task.state_names
        self.action_space = self._action_space()
        self.observation_space = self._observation_space()
        self._painters: dict[str, Painter] = {}
        self._episode: Episode | None = None
        self._simulation: Simulation | None = None
        self._steps = 0
        self._gripper = 0.0

    def _action_space(self) -> spaces.Space[Any]:
        limit = np.append(self.model.description.limits.velocity, 1.0).astype(np.float32)
        low = -limit
        low[-1] = 0.0
        return spaces.Box(low, limit, dtype=np.float32)

    def _observation_space(self) -> spaces.Dict:
        parts: dict[str, spaces.Space[Any]] = {
            "agent_pos": box_space(len(self.agent_names)),
            "environment_state": box_space(len(self.state_names)),
        }
        if self.cameras:
            parts["pixels"] = spaces.Dict({camera: image_space(*self.image_size) for camera in self.cameras})
        return spaces.Dict(parts)

    @property
    def task_description(self) -> str:
        """One sentence: what is to be done."""
        return self.task.description

    @property
    def simulation(self) -> Simulation:
        """The physics of this episode.

        Raises:
            HandrailError: `reset` was not called.
        """
        if self._simulation is None:
            raise HandrailError(f"environment {self.task.name}: call reset() before anything else")
        return self._simulation

    @property
    def episode(self) -> Episode:
        """How this episode began.

        Raises:
            HandrailError: `reset` was not called.
        """
        if self._episode is None:
            raise HandrailError(f"environment {self.task.name}: call reset() before anything else")
        return self._episode

    def state(self) -> State:
        """Return the measured positions, velocities and time, and the velocity sent last."""
        return self.simulation.state()

    def obstacles(self) -> tuple[Obstacle, ...]:
        """Return what a controller has to avoid besides the floor, where it is now and how fast it moves.

        What the fingers hold is among it; its position and rotation are in the frame that it names.
        """
        return (*self.episode.scene.obstacles(float(self.simulation.data.time)), *self.simulation.held())

    def task_state(self) -> TaskState:
        """Return the truth of this moment."""
        now = self.simulation
        return TaskState(
            time=float(now.data.time),
            tool=now.tool,
            opening=now.opening,
            episode=self.episode,
            poses=now.poses(),
            twists=now.twists(),
            stable=now.is_stable,
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; the same seed gives the same one, whatever came before.

        Args:
            seed: of everything random.
            options: `episode`: an `Episode` to begin with instead of a sampled one.
        """
        super().reset(seed=seed)
        episode: Episode = (options or {}).get("episode") or self.task.sample(self.model, self.np_random)
        meshes = bool(self.cameras or self.render_mode)
        self._simulation = Simulation(
            self.model, episode.scene, episode.q, 1.0 / self.fps, meshes=meshes, grip=episode.grip
        )
        self._episode = episode
        self._steps = 0
        self._gripper = float(episode.grip is not None)
        state = self.task_state()
        rest = np.append(np.zeros(self.model.size), self._gripper).astype(np.float32)
        return self._observe(state), self._info(state, Outcome(), rest, contacts=())

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Move for 1/fps seconds; the reward is 1 at success. `info["sent"]` is the action that was sent."""
        sent = self._limit(np.asarray(action, dtype=np.float64).ravel())
        contacts = self.simulation.advance(sent[:-1].astype(np.float64), float(sent[-1]))
        self._steps += 1
        state = self.task_state()
        outcome = self.task.outcome(state) if state.stable else Outcome(failure="unstable")
        truncated = not outcome.over and self._steps >= self._max_episode_steps
        if truncated:
            outcome = Outcome(failure="timeout")
        info = self._info(state, outcome, sent, contacts)
        return self._observe(state), float(outcome.success), outcome.over and not truncated, truncated, info

    def _limit(self, action: FloatArray) -> NDArray[np.float32]:
        """Return what is sent instead of an action, (n + 1,): within the limits, as it can be recorded."""
        size, now = self.model.size, self.state()
        gripper = float(action[size]) if action.size == size + 1 else math.nan
        usable = math.isfinite(gripper)
        self._gripper = min(max(gripper, 0.0), 1.0) if usable else self._gripper
        target = action[:size] if usable else np.full(size, np.nan)
        velocity, _ = self._limiter.limit(now.commanded, target, 1.0 / self.fps, now.q)
        return np.append(velocity, self._gripper).astype(np.float32)

    def _observe(self, state: TaskState) -> Observation:
        observation: Observation = {
            "agent_pos": self._agent.read(self.simulation),
            "environment_state": bounded(self.task.features(state)),
        }
        if self.cameras:
            observation["pixels"] = {camera: self._paint("pixels", camera) for camera in self.cameras}
        return observation

    def _info(
        self, state: TaskState, outcome: Outcome, sent: NDArray[np.float32], contacts: tuple[str, ...]
    ) -> dict[str, Any]:
        return {
            "is_success": outcome.success,
            "failure_reason": outcome.failure,
            "sent": sent,
            "contacts": len(contacts),
            "contact_names": contacts,
            "time": state.time,
        }

    def render(self) -> NDArray[np.uint8] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return a good-looking picture from the scene camera, if `render_mode` is `rgb_array`."""
        return self._paint("render", "scene") if self.render_mode else None

    def _paint(self, use: str, camera: str) -> NDArray[np.uint8]:
        now = self.simulation
        if use not in self._painters:
            size, quality = (self.image_size, FAST) if use == "pixels" else (self.render_size, PRETTY)
            self._painters[use] = Painter(now.mujoco_model, size, quality)
        return self._painters[use].paint(now.mujoco_model, now.data, camera)

    def close(self) -> None:
        """Give the OpenGL contexts back."""
        while self._painters:
            self._painters.popitem()[1].close()


def _check(fps: int, cameras: Sequence[str], render_mode: str | None) -> None:
    if not 10 <= fps <= 100:
        raise HandrailError(f"fps {fps}: expected 10 to 100 steps a second")
    for camera in cameras:
        if camera not in CAMERAS:
            raise unknown_name("camera", camera, CAMERAS)
    if render_mode not in (None, "rgb_array"):
        raise unknown_name("render mode", render_mode, ("rgb_array",))
