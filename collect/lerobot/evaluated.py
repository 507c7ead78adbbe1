"""The environment that LeRobot's evaluation runs: a task, with or without a controller before the robot."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from handrail.collect.config import SessionConfig
from handrail.collect.lerobot.mode_action import ModeAction
from handrail.collect.operators.modes import MODES, TeleopMode
from handrail.collect.session.build import build_controller, build_env, build_mode
from handrail.collect.session.loop import EpisodeLoop
from handrail.collect.session.mode_controller import ModeController
from handrail.collect.world.env import Observation
from handrail.collect.world.observation import MOST, WIDTH, box_space, to_numbers
from handrail.collect.world.rendering import Painter
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import Controller
from handrail.controllers.interface.intent import Intent, decided_gripper

_MOST = 10.0  # of any channel [m/s, rad/s]


class EvaluatedEnv(gymnasium.Wrapper[Observation, NDArray[np.float32], Observation, NDArray[np.float32]]):
    """A task in which a policy's actions mean what they mean in `handrail-evaluate`.

    An action of joint velocities is clipped to the limits; one of a mode's channels is completed by its
    controller. With a mode both are taken: a policy may complete its channels itself. A gripper beyond a half
    closes. An action that is not finite brakes.

    Args:
        config: of the session.
        fps: actions a second [Hz].
        mode: whether actions are the channels of the session's mode.
        scene_in_state: whether robot and scene are one vector, `agent_pos`, as `lerobot-record` records them.
        render_size: height and width of `render` [px].
        first_seed: added to every seed.
    """

    def __init__(
        self,
        config: SessionConfig,
        fps: int,
        mode: bool = False,
        scene_in_state: bool = False,
        render_size: tuple[int, int] = (128, 128),
        first_seed: int = 0,
    ) -> None:
        env = build_env(config, fps, render_size)
        super().__init__(env)
        self._env, self._first_seed, self._painter = env, first_seed, None
        self._channels = Channels.of(env.model.description)
        self._mode = build_mode(config, env.model) if mode else MODES["direct"]
        self._action = ModeAction(self._mode, self._channels) if mode else None
        direct = DirectController(env.model, env.period)

        def build(taken: TeleopMode) -> Controller:
            whole = taken is MODES["direct"]
            return direct if whole else build_controller(taken, env.model, fps, config.task)

        modes = {each.name: each for each in (MODES["direct"], self._mode)}
        self._loop = EpisodeLoop(env, ModeController(modes, build, self._mode))
        self._joined = scene_in_state
        self.observation_space = self._space_shown(env.observation_space)
        size = len(self._action.names) if self._action else env.model.size + 1
        self.action_space = spaces.Box(-_MOST, _MOST, (size,), np.float32)
        self._max_episode_steps = env._max_episode_steps  # LeRobot asks for it

    @property
    def task(self) -> str:
        """One sentence: what is to be done; LeRobot's name for it."""
        return self._env.task_description

    @property
    def task_description(self) -> str:
        """One sentence: what is to be done."""
        return self._env.task_description

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode."""
        self._loop.begin(None if seed is None else seed + self._first_seed)
        return self._shown(self._loop.now.observation), _plain(self._loop.now.info)

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Do what an action asks for, for one period."""
        numbers = np.asarray(action, np.float64)
        whole = numbers.shape == (self._env.model.size + 1,)
        if not whole and numbers.shape != self.action_space.shape:
            raise HandrailError(
                f"action of --env.type=handrail: expected {self._meant}, got {numbers.size} numbers;"
                " --env.mode is for policies that write a mode's channels, and for no others"
            )
        channels = self._action is not None and numbers.shape == self.action_space.shape
        loop = self._loop
        loop.look()
        frame = loop.step(self._intent(numbers, channels))
        over, cut_short = loop.now.terminated, loop.now.done and not loop.now.terminated
        return self._shown(loop.now.observation), float(frame.success), over, cut_short, _plain(loop.now.info)

    def render(self) -> NDArray[np.uint8]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return a quick picture from the scene camera: LeRobot films every step of ten episodes."""
        now = self._env.simulation
        self._painter = self._painter or Painter(self._env.render_size)
        return self._painter.paint(now.mujoco_model, now.data, "scene")

    def close(self) -> None:
        """Give the OpenGL contexts back."""
        if self._painter:
            self._painter.close()
        self._env.close()

    @property
    def _meant(self) -> str:
        names = self._action.names if self._action else (*self._env.model.joints, "gripper")
        return ", ".join(names)

    def _intent(self, numbers: NDArray[np.float64], channels: bool) -> Intent:
        time, gripper = self._env.state().time, decided_gripper(numbers[-1])
        if self._action and channels:
            return self._action.decided(numbers, time)
        values = np.zeros(self._channels.size)
        values[self._channels.joint_slice] = numbers[:-1]
        return Intent(values, self._channels.mask("joint"), gripper, "direct", time)

    def _space_shown(self, plain: spaces.Space[Any]) -> spaces.Dict:
        assert isinstance(plain, spaces.Dict)
        shown: dict[str, spaces.Space[Any]] = dict(plain.spaces)
        if self._joined:
            del shown["environment_state"]
            shown["agent_pos"] = box_space(len(self._env.agent_names) + len(self._env.state_names))
        shapes = {"time": (1,), "sent": (self._env.model.size,), "obstacles": (MOST, WIDTH)}
        told = {name: spaces.Box(-np.inf, np.inf, shape, np.float32) for name, shape in shapes.items()}
        return spaces.Dict(shown | told)

    def _shown(self, observation: Observation) -> Observation:
        """Return what policies see, and what completes their intents: LeRobot hands both on."""
        shown, state = dict(observation), self._env.state()
        if self._joined:
            shown["agent_pos"] = np.concatenate([shown["agent_pos"], shown.pop("environment_state")])
        return shown | {
            "time": np.array([state.time], np.float32),
            "sent": state.commanded.astype(np.float32),
            "obstacles": to_numbers(self._env.obstacles()),
        }


def _plain(info: dict[str, Any]) -> dict[str, Any]:
    """Return what can be stacked over several environments."""
    return {"is_success": bool(info["is_success"])}
