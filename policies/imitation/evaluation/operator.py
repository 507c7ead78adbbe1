"""A trained policy as an operator: it sees what was recorded and asks for what it learned."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from handrail.collect.config import SessionConfig
from handrail.collect.operators.operator import View
from handrail.collect.session.build import build_mode
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import load_model
from handrail.policies.imitation.interface.checkpoint import PolicyMeta
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.trained import TrainedPolicy

if TYPE_CHECKING:
    from handrail.collect.lerobot.mode_action import ModeAction


class RecordedColumns:
    """Reads and writes what was recorded, in place of a `PolicyInterface`: an action is a mode's channels.

    Args:
        action: of the mode; of `direct` it is joint velocities, as in every dataset of ours.
        joined: whether robot and scene are one vector, as `lerobot-record` records `handrail_sim`.
    """

    def __init__(self, action: "ModeAction", joined: bool = False) -> None:
        self._action, self._joined = action, joined

    @classmethod
    def of(cls, meta: PolicyMeta, joined: bool = False) -> "RecordedColumns":
        """Return the columns of a policy."""
        from handrail.collect.lerobot.mode_action import ModeAction

        model = load_model(meta.robot)
        mode = build_mode(SessionConfig(task=meta.environment, mode=meta.intent_mode or "direct"), model)
        return cls(ModeAction(mode, Channels.of(model.description)), joined)

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
        interface: PolicyInterface | RecordedColumns,
        channels: Channels,
        mode: str,
        task: str = "",
    ) -> None:
        self._policy, self._interface, self._mode, self._task = policy, interface, mode, task
        self._unusable = Intent(np.full(channels.size, np.nan), np.ones(channels.size, bool))
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
        if action.shape == (len(self._interface.action_names),) and np.all(np.isfinite(action)):
            intent = self._interface.decode(action, seen["agent_pos"])
        else:
            self.malformed += 1
            intent = self._unusable
        return replace(intent, mode=self._mode, time=view.state.time)
