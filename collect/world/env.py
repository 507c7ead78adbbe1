"""The Gymnasium environment: a robot, a task, velocities in, observations out."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from handrail.collect.world.looks import Looks
from handrail.collect.world.observation import AgentObservation, bounded, box_space
from handrail.collect.world.plant import Plant
from handrail.collect.world.rendering import Painter
from handrail.collect.world.simulation import Simulation
from handrail.collect.world.task import Start, Task, TaskState, Verdict
from handrail.controllers.arrays import FloatArray, are_finite, frozen
from handrail.controllers.errors import HandrailError, check_known, shown, unknown_name
from handrail.controllers.interface.controller import State
from handrail.controllers.registry import resolved
from handrail.controllers.robot.description import SCENE_CAMERA
from handrail.controllers.robot.model import RobotModel, load_model
from handrail.controllers.robot.shape import Obstacle
from handrail.controllers.typed import Positive, check

Observation = dict[str, Any]
RENDER_SIZE = (480, 640)  # height, width [px]


class HandrailEnv(gymnasium.Env[Observation, NDArray[np.float32]]):
    """A robot does a task.

    Action, (n + h,) float32: the generalised velocities that the robot shall have at the end of the step
    [m/s, rad/s], reached linearly from those commanded before, and each gripper (0 open, 1 closed). The sent
    command is inside the robot's limits; an action that is not finite brakes.

    Args:
        task: a `Task`, or the name of its class as `module:Class`.
        robot: name of a robot, its description file, or its model, which says the hand that does the task.
        fps: steps a second, 10 to 100.
        plant: makes the robot in its world, as the class `Simulation` does: MuJoCo's, or another.
        cameras: which of the robot's, or `scene`, to show as `pixels`.
        image_size: height and width of `pixels` [px].
        render_mode: `rgb_array` or None.
        render_size: height and width of what `render` returns [px].
        sample: draws how an episode begins, `(model, rng)`, instead of the task.
        looks: what of a simulation's looks is drawn anew in each episode.
        real: whether a step takes its time, as of a robot that is no simulation: there is no way back.

    Attributes:
        task, fps, cameras, image_size, render_size, real: as they were said.
        model: kinematics of the robot.
        period: from one step to the next [s].
        seen: the robot and the truth after the last step.
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
        looks: Looks = Looks(),  # noqa: B008  (frozen)
        real: bool = False,
    ) -> None:
        if not 10 <= fps <= 100:
            raise HandrailError(f"fps {fps}: expected 10 to 100 steps a second")
        if render_mode not in (None, "rgb_array"):
            raise unknown_name("render mode", render_mode, ("rgb_array",))
        self.task: Task = resolved(task, f"task {task}")() if isinstance(task, str) else task
        self.model: RobotModel = robot if isinstance(robot, RobotModel) else load_model(robot)
        self.fps, self.period, self.real = fps, 1.0 / fps, real
        self.cameras, self.image_size = tuple(cameras), image_size
        check_known("camera", self.cameras, self.model.description.camera_names)
        self.render_mode, self.render_size = render_mode, render_size
        self.metadata = {**type(self).metadata, "render_fps": fps}
        seconds = check(float(self.task.time_limit), Positive, "time_limit of the task")
        self._max_episode_steps = math.ceil(seconds * fps - 1e-6)
        self._build, self._looks = plant, looks
        self._sample = sample or self.task.sample
        self._agent = AgentObservation(self.model)
        self.agent_names, self.state_names = self._agent.names, self.task.state_names
        fastest, hands = self.model.description.limits.velocity, len(self.model.description.hands)
        limit, least = (np.append(*each) for each in ((fastest, np.ones(hands)), (-fastest, np.zeros(hands))))
        self.action_space = spaces.Box(least.astype(np.float32), limit.astype(np.float32), dtype=np.float32)
        seen = {
            "agent_pos": box_space(len(self.agent_names)),
            "environment_state": box_space(len(self.state_names)),
        }
        if self.cameras:
            picture = spaces.Box(0, 255, (*self.image_size, 3), np.uint8)
            seen["pixels"] = spaces.Dict(dict.fromkeys(self.cameras, picture))
        self.observation_space = spaces.Dict(seen)
        self._painters: dict[str, Painter] = {}
        self._begun: tuple[Start, Plant] | None = None

    @property
    def _episode(self) -> tuple[Start, Plant]:
        if self._begun is None:
            raise HandrailError(f"environment {type(self.task).__name__}: call reset() before anything else")
        return self._begun

    @property
    def start(self) -> Start:
        """How this episode began."""
        return self._episode[0]

    @property
    def plant(self) -> Plant:
        """The robot of this episode, and the world around it."""
        return self._episode[1]

    @property
    def simulation(self) -> Simulation:
        """The physics of this episode, to be drawn or pushed."""
        if not isinstance(self.plant, Simulation):
            raise HandrailError(
                f"environment {type(self.task).__name__}: expected physics, got an ideal robot"
            )
        return self.plant

    def state(self) -> State:
        """Return the measured positions, velocities and time, and the velocity sent last."""
        return self.plant.state()

    def obstacles(self) -> tuple[Obstacle, ...]:
        """Return what a controller has to avoid besides the floor, where it is now and how fast it moves.

        What the fingers hold is among it; its position and rotation are in the frame that it names.
        """
        return self.plant.obstacles()

    def task_state(self) -> TaskState:
        """Return the truth of this moment."""
        start, now = self._episode
        return TaskState(
            time=now.time,
            tools=now.tools,
            openings=now.openings,
            start=start,
            poses=now.poses(),
            still=now.still(),
            stable=now.is_stable,
            scale=self.model.description.world.scale,
            hand=self.model.number,
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
        grip = self._by_hand(start.grip)
        plant = self._build(self.model, start.scene, start.q, self.period, meshes=meshes, grip=grip)
        if meshes and isinstance(plant, Simulation):
            plant.dress(self._looks, self.np_random.spawn(1)[0])  # which draws nothing from it
        self._begun, self._steps = (start, plant), 0
        rest = np.append(np.zeros(self.model.size), [float(width is not None) for width in grip])
        self._sent = rest.astype(np.float32)
        return self._shown(self.task_state())

    def _by_hand(self, grip: tuple[float | None, ...]) -> tuple[float | None, ...]:
        """Return the width that each hand holds, of widths that begin with the hand that does the task."""
        hands = range(len(self.model.description.hands))
        order = sorted(hands, key=lambda hand: hand != self.model.number)
        held = dict(zip(order, grip, strict=False))
        return tuple(held.get(hand) for hand in hands)

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Move for 1/fps seconds; the reward is 1 at success. `info["sent"]` is the action that was sent."""
        self._sent = self.plant.send(action)
        self._steps += 1
        state = self.task_state()
        verdict = self.task.outcome(state) if state.stable else Verdict(failure="unstable")
        truncated = not verdict.over and self._steps >= self._max_episode_steps
        if truncated:
            verdict = Verdict(failure="timeout")
        observation, info = self._shown(state, verdict)
        return observation, float(verdict.success), verdict.over and not truncated, truncated, info

    def rest(self) -> tuple[Observation, dict[str, Any]]:
        """Let the robot stand for a period that is none of the episode's."""
        self._sent = self.plant.send(())
        return self._shown(self.task_state())

    def _shown(self, state: TaskState, verdict: Verdict | None = None) -> tuple[Observation, dict[str, Any]]:
        """Return observation and info of a moment: the one place where they are assembled."""
        verdict, contacts = verdict or Verdict(), self.plant.contacts
        self.seen = self.state(), state
        info = {
            "is_success": verdict.success,
            "failure_reason": verdict.failure,
            "sent": self._sent,
            "contacts": len(contacts),
            "contact_names": contacts,
            "time": state.time,
        }
        observation: Observation = {
            "agent_pos": self._agent.read(self.seen[0], state.tools, state.openings),
            "environment_state": bounded(self._features(state)),
        }
        if self.cameras:
            observation["pixels"] = self.pictures(self.cameras)
        return observation, info

    def _features(self, state: TaskState) -> FloatArray:
        """Return the task's features, checked; of unstable physics or a real robot they may be NaN."""
        where, count = f"task {type(self.task).__name__}", len(self.state_names)
        found = frozen(self.task.features(state), what=f"features of {where}")
        if found.shape != (count,) or not (self.real or not state.stable or are_finite(found)):
            raise HandrailError(f"{where}: expected {count} finite numbers of features, got {shown(found)}")
        return found

    def pictures(self, cameras: tuple[str, ...]) -> dict[str, NDArray[np.uint8]]:
        """Return what cameras see now, `image_size` each; a simulation without any needs a `render_mode`."""
        if self.real:
            return dict(self.plant.pictures(cameras, self.image_size))
        return {camera: self.paint("pixels", camera, self.image_size) for camera in cameras}

    def checkpoint(self) -> object:
        """Return where the episode stands, to come back to."""
        return self.plant, self.plant.checkpoint(), self._steps, self._sent

    def restore(self, checkpoint: Any) -> tuple[Observation, dict[str, Any]]:
        """Come back to where this episode stood; from there all goes on as it did."""
        plant, state, steps, sent = checkpoint
        if plant is not self.plant:
            raise HandrailError(
                f"environment {type(self.task).__name__}: expected a checkpoint of this episode, "
                "got one from before reset()"
            )
        self.plant.restore(state)
        self._steps, self._sent = steps, sent
        return self._shown(self.task_state())

    def render(self) -> NDArray[np.uint8] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return a good-looking picture from the scene camera, if `render_mode` is `rgb_array`."""
        return self.paint("render", SCENE_CAMERA, self.render_size) if self.render_mode else None

    def paint(self, use: str, camera: str, size: tuple[int, int]) -> NDArray[np.uint8]:
        """Return a picture of a camera, (height, width, 3); each use keeps a painter of its own."""
        now = self.simulation
        painter = self._painters.get(use) or Painter(size, pretty=use == "render")
        self._painters[use] = painter
        return painter.paint(now.mujoco_model, now.data, camera)

    def close(self) -> None:
        """Give the OpenGL contexts back."""
        while self._painters:
            self._painters.popitem()[1].close()
