"""The Gymnasium environment: a robot, a task, velocities in, observations out."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import load_env_creator
from numpy.typing import ArrayLike, NDArray

from handrail.collect.world.observation import AgentObservation, bounded, box_space
from handrail.collect.world.plant import Plant, Robot, Seeing, World
from handrail.collect.world.rendering import CAMERAS, Painter
from handrail.collect.world.simulation import Simulation
from handrail.collect.world.task import Start, Task, TaskState, Verdict
from handrail.controllers.errors import HandrailError, unknown_name
from handrail.controllers.interface.controller import State
from handrail.controllers.robot.model import RobotModel, load_model
from handrail.controllers.robot.shape import Obstacle

Observation = dict[str, Any]
RENDER_SIZE = (480, 640)  # height, width [px]
_NOTHING = np.zeros(0, dtype=np.float32)


class HandrailEnv(gymnasium.Env[Observation, NDArray[np.float32]]):
    """A robot does a task.

    Action, (n + 1,) float32: the generalised velocities that the robot shall have at the end of the step
    [m/s, rad/s], reached linearly from those commanded before, and the gripper (0 open, 1 closed). What is
    sent is inside the robot's limits; an action that is not finite brakes.

    Args:
        task: a `Task`, or the name of its class as `module:Class`.
        robot: name of a robot, its description file, or its model.
        fps: steps a second, 10 to 100.
        plant: makes the robot in its world, as the class `Simulation` does: MuJoCo's, or another.
        cameras: which of `wrist`, `scene` to show as `pixels`.
        image_size: height and width of `pixels` [px].
        render_mode: `rgb_array` or None.
        render_size: height and width of what `render` returns [px].
        sample: draws how an episode begins, `(model, rng)`, instead of the task.
        observes: whether there is anything in observations; without, steps are quicker.
        real: whether a step takes its time, as of a robot that is no simulation: there is no way back.

    Attributes:
        real: as it was said.
        task: what is to be done.
        model: kinematics of the robot.
        fps: steps a second.
        agent_names: names of the numbers in `agent_pos`.
        state_names: names of the numbers in `environment_state`.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012  (Gymnasium's name)

    def __init__(
        self,
        task: Task | str,
        robot: str | Path | RobotModel = "ridgeback_ur10",
        *,
        fps: float = 20,
        plant: Callable[..., Plant] = Simulation,
        cameras: Sequence[str] = (),
        image_size: tuple[int, int] = (128, 128),
        render_mode: str | None = None,
        render_size: tuple[int, int] = RENDER_SIZE,
        sample: Callable[[RobotModel, np.random.Generator], Start] | None = None,
        observes: bool = True,
        real: bool = False,
    ) -> None:
        _check(fps, cameras, render_mode)
        self.real = real
        self.task: Task = load_env_creator(task)() if isinstance(task, str) else task  # pyright: ignore
        self.model: RobotModel = robot if isinstance(robot, RobotModel) else load_model(robot)
        self.fps = fps
        self.cameras = tuple(cameras)
        self.image_size = (int(image_size[0]), int(image_size[1]))
        self.render_mode = render_mode
        self.render_size = (int(render_size[0]), int(render_size[1]))
        self.metadata = {**type(self).metadata, "render_fps": fps}
        self._max_episode_steps = math.ceil(self.task.horizon * fps)
        self._build, self._observes = plant, observes
        self._sample = sample or self.task.sample
        self._agent = AgentObservation(self.model)
        self.agent_names = self._agent.names
        self.state_names = self.task.state_names
        self.action_space = self._action_space()
        self.observation_space = self._observation_space()
        self._painters: dict[str, Painter] = {}
        self._begun: tuple[Start, Plant] | None = None
        self._steps = 0

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
            picture = spaces.Box(0, 255, (*self.image_size, 3), np.uint8)
            parts["pixels"] = spaces.Dict(dict.fromkeys(self.cameras, picture))
        return spaces.Dict(parts)

    @property
    def task_description(self) -> str:
        """One sentence: what is to be done."""
        return self.task.description

    @property
    def period(self) -> float:
        """From one step to the next [s]."""
        return 1.0 / self.fps

    @property
    def robot(self) -> Robot:
        """The robot of this episode."""
        return self._present

    @property
    def world(self) -> World:
        """What is around it, and the truth by which the task judges."""
        return self._present

    @property
    def simulation(self) -> Simulation:
        """The physics of this episode, to be drawn or pushed."""
        if not isinstance(self._present, Simulation):
            raise HandrailError(
                f"environment {type(self.task).__name__}: expected physics, got an ideal robot"
            )
        return self._present

    @property
    def _present(self) -> Plant:
        return self._now[1]

    @property
    def _now(self) -> tuple[Start, Plant]:
        if self._begun is None:
            raise HandrailError(f"environment {type(self.task).__name__}: call reset() before anything else")
        return self._begun

    @property
    def start(self) -> Start:
        """How this episode began."""
        return self._now[0]

    def state(self) -> State:
        """Return the measured positions, velocities and time, and the velocity sent last."""
        return self.robot.state()

    def obstacles(self) -> tuple[Obstacle, ...]:
        """Return what a controller has to avoid besides the floor, where it is now and how fast it moves.

        What the fingers hold is among it; its position and rotation are in the frame that it names.
        """
        return self.world.obstacles()

    def task_state(self) -> TaskState:
        """Return the truth of this moment."""
        now = self.world
        return TaskState(
            time=now.time,
            tool=now.tool,
            opening=now.opening,
            start=self.start,
            poses=now.poses(),
            still=now.still(),
            stable=now.is_stable,
            scale=self.model.description.world.scale,
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; the same seed gives the same one, whatever came before.

        Args:
            seed: of everything random.
            options: `start`: a `Start` to begin with instead of a sampled one.
        """
        super().reset(seed=seed)
        start: Start = (options or {}).get("start") or self._sample(self.model, self.np_random)
        meshes = bool(self.cameras or self.render_mode)
        plant = self._build(self.model, start.scene, start.q, self.period, meshes=meshes, grip=start.grip)
        self._begun = start, plant
        self._steps = 0
        state = self.task_state()
        rest = np.append(np.zeros(self.model.size), float(start.grip is not None)).astype(np.float32)
        return self._observe(state), self._info(state, Verdict(), rest)

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Move for 1/fps seconds; the reward is 1 at success. `info["sent"]` is the action that was sent."""
        sent = self.robot.send(action)
        self._steps += 1
        state = self.task_state()
        outcome = self.task.outcome(state) if state.stable else Verdict(failure="unstable")
        truncated = not outcome.over and self._steps >= self._max_episode_steps
        if truncated:
            outcome = Verdict(failure="timeout")
        info = self._info(state, outcome, sent)
        return self._observe(state), float(outcome.success), outcome.over and not truncated, truncated, info

    def _observe(self, state: TaskState) -> Observation:
        if not self._observes:
            return {"agent_pos": _NOTHING, "environment_state": _NOTHING}
        observation: Observation = {
            "agent_pos": self._agent.read(self.state(), state.tool, state.opening),
            "environment_state": bounded(self.task.features(state)),
        }
        if self.cameras:
            observation["pixels"] = self._pictures()
        return observation

    def _pictures(self) -> Mapping[str, NDArray[np.uint8]]:
        if isinstance(self._present, Seeing):
            return self._present.pictures(self.cameras, self.image_size)
        return {camera: self._paint("pixels", camera) for camera in self.cameras}

    def _info(self, state: TaskState, outcome: Verdict, sent: NDArray[np.floating[Any]]) -> dict[str, Any]:
        contacts = self.world.contacts
        return {
            "is_success": outcome.success,
            "failure_reason": outcome.failure,
            "sent": sent,
            "contacts": len(contacts),
            "contact_names": contacts,
            "time": state.time,
        }

    def checkpoint(self) -> object:
        """Return where the episode stands, to come back to."""
        return self.world.checkpoint(), self._steps

    def restore(self, checkpoint: Any) -> tuple[Observation, dict[str, Any]]:
        """Come back to where the episode stood; from there all goes on as it did."""
        plant, self._steps = checkpoint
        self.world.restore(plant)
        state = self.task_state()
        sent = np.append(self.robot.state().commanded, 0.0).astype(np.float32)
        return self._observe(state), self._info(state, Verdict(), sent)

    def render(self) -> NDArray[np.uint8] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return a good-looking picture from the scene camera, if `render_mode` is `rgb_array`."""
        return self._paint("render", "scene") if self.render_mode else None

    def _paint(self, use: str, camera: str) -> NDArray[np.uint8]:
        now = self.simulation
        if use not in self._painters:
            pretty = use == "render"
            size = self.render_size if pretty else self.image_size
            self._painters[use] = Painter(size, pretty)
        return self._painters[use].paint(now.mujoco_model, now.data, camera)

    def close(self) -> None:
        """Give the OpenGL contexts back."""
        while self._painters:
            self._painters.popitem()[1].close()


def _check(fps: float, cameras: Sequence[str], render_mode: str | None) -> None:
    if not 10 <= fps <= 100:
        raise HandrailError(f"fps {fps}: expected 10 to 100 steps a second")
    for camera in cameras:
        if camera not in CAMERAS:
            raise unknown_name("camera", camera, CAMERAS)
    if render_mode not in (None, "rgb_array"):
        raise unknown_name("render mode", render_mode, ("rgb_array",))
