"""A trained policy as an operator: it sees what was recorded and asks for what it learned."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from handrail.collect.operators.operator import View
from handrail.controllers.arrays import FloatArray
from handrail.controllers.channels import Channels
from handrail.controllers.intent import Intent


class Interface(Protocol):
    """How a policy's numbers come from and go to what Handrail records."""

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of the numbers in an action, (a,)."""
        ...

    def observe(self, state: FloatArray, environment: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what the policy sees of an observation."""
        ...

    def decode(self, action: FloatArray, state: FloatArray) -> Intent:
        """Return what an action asks for."""
        ...


class Policy(Protocol):
    """A trained policy."""

    @property
    def interface(self) -> Any:
        """How it is spoken to: an `Interface`."""
        ...

    def reset(self) -> None:
        """Forget the episode before."""
        ...

    def act(self, state: FloatArray, environment: FloatArray, images: Mapping[str, np.ndarray]) -> FloatArray:
        """Return the action, (a,)."""
        ...


class PolicyOperator:
    """Lets a policy steer; an operator.

    An action of another size, or one that is not finite, becomes an intent that no controller accepts: the
    robot brakes.

    Args:
        policy: whoever was trained.
        channels: of the robot.
        mode: name of the teleop mode that the intents carry.

    Attributes:
        malformed: unusable actions of this episode so far.
    """

    def __init__(self, policy: Policy, channels: Channels, mode: str) -> None:
        self._policy = policy
        self._interface: Interface = policy.interface
        self._channels = channels
        self._mode = mode
        self.malformed = 0

    @property
    def name(self) -> str:
        """Who steers."""
        return "policy"

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode; what the policy draws comes from the episode's seed."""
        import torch

        torch.manual_seed(int(rng.integers(2**31)))
        self._policy.reset()
        self.malformed = 0

    def act(self, view: View) -> Intent:
        """Return the intent now."""
        seen = view.observation
        observed = self._interface.observe(seen["agent_pos"], seen["environment_state"])
        action = np.asarray(self._policy.act(*observed, seen.get("pixels", {})))
        if action.shape != (len(self._interface.action_names),) or not np.all(np.isfinite(action)):
            self.malformed += 1
            return self._unusable(view.state.time)
        intent = self._interface.decode(action, seen["agent_pos"])
        return replace(intent, mode=self._mode, time=view.state.time)

    def _unusable(self, time: float) -> Intent:
        size = self._channels.size
        return Intent(np.full(size, np.nan), np.ones(size, bool), mode=self._mode, time=time)
