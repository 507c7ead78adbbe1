"""An operator who tries everything once, before a person waits for it in real time."""

from collections.abc import Iterator, Mapping

import numpy as np

from handrail.collect.operators.modes import TeleopMode
from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.operators.person.inputs import Input
from handrail.collect.operators.person.meaning import InputMeaning, Setting
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import RobotModel

_PERIODS = 3  # of each mode
_BRAKING = 40  # periods
_DEFLECTION = 0.3  # of a stick


class Rehearsal:
    """Steers in each mode for some periods, brakes, steers, takes that back, steers again, and ends.

    Args:
        model: of the robot.
        modes: by name.
    """

    def __init__(self, model: RobotModel, modes: Mapping[str, TeleopMode]) -> None:
        self._modes = tuple(modes.values())
        self._meaning, self._hand = InputMeaning(model), model.hand.name

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin."""
        self._acts = self._all()

    def act(self, view: View) -> Intent | EpisodeEvent:
        """Return the next intent or event."""
        now = next(self._acts, EpisodeEvent.QUIT)
        if isinstance(now, EpisodeEvent):
            return now
        axes = (_DEFLECTION,) * self._meaning.channels.size
        grips = (False,) * len(self._meaning.hands)
        return self._meaning.intent(Input(True, "rehearsal", grips, axes, 0.0, ()), now, view.state)

    def _all(self) -> Iterator[Setting | EpisodeEvent]:
        for mode in self._modes:
            for focus in ("hand", "base") if mode.by_focus else ("hand",):
                yield from (Setting(mode, focus, self._hand) for _ in range(_PERIODS))
        yield from (EpisodeEvent.PAUSE for _ in range(_BRAKING))
        again = [Setting(self._modes[0], hand=self._hand)] * _PERIODS
        yield from (*again, EpisodeEvent.UNDO, *again)
