"""Blended control: an operator and an actor with a goal of its own weigh in one objective."""

from dataclasses import replace

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.sources import Intents, IntentSource
from handrail.controllers.interface.usual_frames import in_usual_frames
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.numerics.rotation import rotation_vector
from handrail.controllers.robot.model import Pose
from handrail.controllers.robot.shape import Obstacle

SHARE = 0.5  # α of an actor that wants to go the operator's way
_GAIN = 1.2  # k, of the way to go [1/s]
_SPEED, _RATE = 0.35, 0.6  # of the actor at most, at scale 1 [m/s, rad/s]


class BlendedMpc(MaskedMpc):
    """The masked MPC of two: `(1 - α) ‖M (c - û)‖² + α ‖M (c - ĉ)‖²`; a controller.

    û is the operator's command; ĉ is the actor's, that leads the hand to its goal: `v̂ = k (p* - p)` and
    `ω̂ = k log(R* Rᵀ)`, their norms bounded. It acts on what the operator commands of that hand, and only
    while they move it: let go, the robot stands still. Of translation and of turns by themselves,
    `α = ½ max(0, û·ĉ / ‖û‖ ‖ĉ‖)`: the actor helps as far as both want the same. Without a goal it is the
    masked MPC. After the blended control that the paper cites as [9], where the actor is a planner; that α
    goes by agreement is after Dragan, Srinivasa, *A policy-blending formalism for shared control* (2013).
    """

    _goal: Pose | None = None

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the past, the goal too; take the obstacles of a new episode."""
        self._goal = None
        super().reset(obstacles)

    def aim(self, goal: Pose) -> None:
        """Say where the hand is to be brought now."""
        self._goal = goal

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command from now on, by both."""
        return super().update(state, self._both(state, intent))

    def _both(self, state: State, intent: Intent) -> Intent:
        """Return the intents of operator and actor, or the operator's alone."""
        hand = self.channels.hand_slice(self.model.number)
        fits = intent.values.shape == intent.mask.shape == (self.channels.size,) and intent.is_finite
        moves = fits and bool(np.any(np.where(intent.mask, intent.values, 0.0)[hand]))
        if self._goal is None or not (moves and state.is_of(self.model.size) and intent.frames.are_known):
            return intent
        operator = in_usual_frames(intent, self.model, state.q)
        if operator is None:
            return intent
        mask, (values, share) = np.zeros_like(intent.mask), np.zeros((2, self.channels.size))
        mask[hand], values[hand] = intent.mask[hand], self._wanted(self._goal, state.q)
        for part in (slice(hand.start, hand.start + 3), slice(hand.start + 3, hand.stop)):
            asked = np.where(operator.mask, operator.values, 0.0)[part]
            lengths = float(np.linalg.norm(asked) * np.linalg.norm(values[part]))
            share[part] = SHARE * max(0.0, float(asked @ values[part]) / max(lengths, 1e-9))
        sources = (
            IntentSource("operator", operator, np.where(mask, 1.0 - share, 1.0)),
            IntentSource("actor", replace(operator, values=values, mask=mask), share),
        )
        return Intents.of(sources, intent.grippers, operator)

    def _wanted(self, goal: Pose, q: FloatArray) -> FloatArray:
        """Return the twist that leads the hand to a goal, (6,)."""
        tool, scale = self.model.pose(q), self.model.description.world.scale
        way, turn = goal.position - tool.position, rotation_vector(goal.rotation @ tool.rotation.T)
        parts = zip((way, turn), (scale * _SPEED, _RATE), strict=True)
        return np.concatenate([_shortened(_GAIN * part, largest) for part, largest in parts])


def _shortened(vector: FloatArray, largest: float) -> FloatArray:
    return vector * min(1.0, largest / max(float(np.linalg.norm(vector)), 1e-9))
