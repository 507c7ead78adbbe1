"""The environment that LeRobot's evaluation runs: a task, with or without a controller before the robot."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from handrail.collect.config import SessionConfig
from handrail.collect.lerobot.mode_action import ModeAction, mode_loop
from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_env, build_mode
from handrail.collect.world.env import Observation
from handrail.collect.world.observation import MOST, WIDTH, box_space, to_numbers
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels

_MOST = 10.0  # of any channel [m/s, rad/s]
_WHOLE = MODES["direct"]  # the mode of actions that are joint velocities


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
        self._env, self._first_seed = env, first_seed
        own = build_mode(config, env.model) if mode else _WHOLE
        channels = Channels.of(env.model.description)
        self._actions = tuple(ModeAction(each, channels, env.model.hand.name) for each in (own, _WHOLE))
        self._loop = mode_loop(env, config.task, own, _WHOLE)
        self._joined = scene_in_state
        self._tools = [hand.named("tool") for hand in env.model.description.hands]
        self.observation_space = self._space_shown(env.observation_space)
        self.action_space = spaces.Box(-_MOST, _MOST, (len(self._actions[0].names),), np.float32)
        self._max_episode_steps = env._max_episode_steps  # LeRobot asks for it

    @property
    def task_description(self) -> str:
        """One sentence: what is to be done."""
        return self._env.task.description

    task = task_description  # LeRobot asks for both

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode."""
        self._loop.begin(None if seed is None else seed + self._first_seed)
        return self._shown(), self._info()

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Do what an action asks for, for one period."""
        numbers, loop = np.asarray(action, np.float64), self._loop
        taken = next((each for each in self._actions if numbers.shape == (len(each.names),)), None)
        if taken is None:
            raise HandrailError(
                f"action of --env.type=handrail: expected {', '.join(self._actions[0].names)}, got "
                f"{numbers.size} numbers; --env.mode is for policies that write a mode's channels, "
                "and for no others"
            )
        frame = loop.step(taken.intent(numbers, loop.look().state.time))
        over, cut_short = loop.now.terminated, loop.now.done and not loop.now.terminated
        return self._shown(), float(frame.success), over, cut_short, self._info()

    def render(self) -> NDArray[np.uint8]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return a quick picture from the scene camera: LeRobot films every step of ten episodes."""
        return self._env.paint("evaluation", "scene", self._env.render_size)

    def _space_shown(self, plain: spaces.Space[Any]) -> spaces.Dict:
        assert isinstance(plain, spaces.Dict)
        shown: dict[str, spaces.Space[Any]] = dict(plain.spaces)
        if self._joined:
            del shown["environment_state"]
            shown["agent_pos"] = box_space(len(self._env.agent_names) + len(self._env.state_names))
        shapes = {"time": (1,), "sent": (self._env.model.size,), "obstacles": (MOST, WIDTH)}
        told = {name: spaces.Box(-np.inf, np.inf, shape, np.float32) for name, shape in shapes.items()}
        return spaces.Dict(shown | told)

    def _shown(self) -> Observation:
        """Return what policies see, and what completes their intents: LeRobot hands both on."""
        shown, state = dict(self._loop.now.observation), self._env.state()
        if self._joined:
            shown["agent_pos"] = np.concatenate([shown["agent_pos"], shown.pop("environment_state")])
        return shown | {
            "time": np.array([state.time], np.float32),
            "sent": state.commanded.astype(np.float32),
            "obstacles": to_numbers(self._env.obstacles(), self._tools),
        }

    def _info(self) -> dict[str, Any]:
        """Return what can be stacked over several environments."""
        return {"is_success": bool(self._loop.now.info["is_success"])}
