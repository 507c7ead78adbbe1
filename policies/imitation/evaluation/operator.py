"""A trained policy as an operator: it sees what was recorded and asks for what it learned."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from handrail.collect.operators.operator import View
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent, decided_gripper
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.trained import TrainedPolicy

if TYPE_CHECKING:
    from handrail.collect.lerobot.mode_action import ModeAction


class AsRecorded:
    """Observations and commanded joint velocities as the dataset has them; in place of a `PolicyInterface`.

    Args:
        channels: of the robot.
    """

    def __init__(self, channels: Channels) -> None:
        self._channels = channels

    @property
    def action_names(self) -> tuple[str, ...]:
        """The joints' velocities and the gripper, (n + 1,)."""
        return (*self._channels.joints, "gripper")

    def observe(self, state: FloatArray, environment: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the observation."""
        return state, environment

    def decode(self, action: FloatArray, state: FloatArray) -> Intent:
        """Return an intent on every joint."""
        values = np.zeros(self._channels.size)
        values[self._channels.joint_slice] = action[:-1]
        return Intent(values, self._channels.mask("joint"), gripper=decided_gripper(action[-1]))


class AsSteered:
    """What `lerobot-record` records of `handrail_sim`: a mode's channels; perhaps robot and scene as one.

    Args:
        action: of the mode.
        joined: whether robot and scene are one vector.
    """

    def __init__(self, action: "ModeAction", joined: bool) -> None:
        self._action, self._joined = action, joined

    @property
    def action_names(self) -> tuple[str, ...]:
        """The channels, the focus if there is one, and the gripper."""
        return self._action.names

    def observe(self, state: FloatArray, environment: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the observation."""
        return (np.append(state, environment), environment[:0]) if self._joined else (state, environment)

    def decode(self, action: FloatArray, state: FloatArray) -> Intent:
        """Return the intent on the mode's channels."""
        return self._action.intent(action, 0.0)


class PolicyOperator:
    """Lets a policy steer; an operator.

    An action of another size, or one that is not finite, becomes an intent that no controller accepts: the
    robot brakes.

    Args:
        policy: whoever was trained.
        interface: what it reads and writes.
        channels: of the robot.
        mode: name of the teleop mode that the intents carry.
        task: one sentence: what to do.

    Attributes:
        malformed: unusable actions of this episode so far.
    """

    def __init__(
        self,
        policy: TrainedPolicy,
        interface: PolicyInterface | AsRecorded | AsSteered,
        channels: Channels,
        mode: str,
        task: str = "",
    ) -> None:
        self._policy = policy
        self._interface = interface
        self._channels = channels
        self._mode = mode
        self._task = task
        self.malformed = 0

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""
        self._policy.reset()
        self.malformed = 0

    def act(self, view: View) -> Intent:
        """Return the intent now."""
        seen = view.observation
        observed = self._interface.observe(seen["agent_pos"], seen["environment_state"])
        action = np.asarray(self._policy.act(*observed, seen.get("pixels", {}), self._task))
        if action.shape != (len(self._interface.action_names),) or not np.all(np.isfinite(action)):
            self.malformed += 1
            return self._unusable(view.state.time)
        intent = self._interface.decode(action, seen["agent_pos"])
        return replace(intent, mode=self._mode, time=view.state.time)

    def _unusable(self, time: float) -> Intent:
        size = self._channels.size
        return Intent(np.full(size, np.nan), np.ones(size, bool), mode=self._mode, time=time)
