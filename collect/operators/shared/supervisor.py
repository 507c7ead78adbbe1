"""A scripted supervisor: watches a policy as a person would, and takes over when it gets no further."""

from dataclasses import replace

import numpy as np

from handrail.collect.operators.modes import Focus, TeleopMode
from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.scripted import ScriptedOperator, scripted_operator
from handrail.collect.operators.scripted.steering import Target, pose_errors
from handrail.collect.world.tasks.catalogue import TaskSpec
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.intent import Intent, RawInput
from handrail.controllers.robot.model import RobotModel

_PATIENCE = 3.0  # without progress [s]
_PROGRESS = 0.02  # what counts as some: so much nearer to the next thing to do [m]
_STRAY = 0.10  # further away from it than before is enough at once [m]
_DECISION = 0.7  # from there until their hand is on the stick [s]
_SHORTEST = 1.0  # help [s]
_TURN = 0.3  # what weighs as much as a radian [m]


class PolicySupervisor:
    """Knows what is to be done next; helps when the hand comes no nearer to it; an operator.

    With e the distance to the script's next target, it helps a moment after e has not fallen by 2 cm · scale
    for 3 s, or has risen by 10 cm · scale. Once it has helped for 1 s, it lets go when the target of that
    moment is reached.

    Args:
        helper: what the person does where they steer.
        scale: of the robot's world.
    """

    def __init__(self, helper: ScriptedOperator, scale: float) -> None:
        self._helper, self._scale = helper, scale

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode: the policy drives."""
        self._helper.reset(view, rng)
        self._watches: bytes | None = None  # which target
        self._nearest, self._since = np.inf, view.state.time
        self._takes = np.inf  # when the hand is on the stick [s]

    def act(self, view: View) -> Intent:
        """Return what they steer now; nothing moves while they watch."""
        time, intent = view.state.time, self._helper.act(view)
        reached = self._note(view)
        if time >= self._takes + _SHORTEST and reached:
            self._takes = np.inf
        if time >= self._takes:
            return intent
        late = time - self._since > _PATIENCE
        if self._takes == np.inf and (late or self._strays):
            self._takes = time + _DECISION
        return replace(intent, values=np.zeros_like(intent.values), raw=RawInput())

    def _note(self, view: View) -> bool:
        """Look how far it is to the target; return whether that is another one than before."""
        target, time = self._helper.target, view.state.time
        identity = target.identity if target else b""
        another = identity != self._watches
        error = self._error(target, view)
        if another or error < self._nearest - self._scale * _PROGRESS:
            self._watches, self._nearest, self._since = identity, error, time
        self._strays = error > self._nearest + self._scale * _STRAY
        return another

    def _error(self, target: Target | None, view: View) -> float:
        if target is None:
            return 0.0
        distance, angle = pose_errors(target.steered(view.task), target.hand)
        return float(distance + self._scale * _TURN * angle)


def supervisor(model: RobotModel, mode: TeleopMode, task: TaskSpec, human: HumanSettings) -> PolicySupervisor:
    """Return who supervises a policy that does a task, and helps in a mode."""
    return PolicySupervisor(scripted_operator(model, mode, task, human), model.description.world.scale)


def hand_supervisor(
    model: RobotModel, mode: TeleopMode, task: TaskSpec, human: HumanSettings
) -> PolicySupervisor:
    """Return who supervises as `supervisor`, but leaves the base to the policy whatever the mode owns."""

    def groups(focus: Focus) -> tuple[str, ...]:
        return tuple(name for name in mode.groups(focus) if name.split(".")[0] not in ("base", "joint"))

    if not (groups("hand") and groups("base")):
        words = "expected a mode that steers a hand throughout, such as base+ee"
        raise HandrailError(f"--operator hand_supervisor: {words}, got {mode.name}")
    return supervisor(model, replace(mode, groups=groups), task, human)
