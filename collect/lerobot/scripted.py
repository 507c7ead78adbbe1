"""The scripted operator as LeRobot's `Teleoperator`."""

from dataclasses import replace

import numpy as np

from handrail.collect.lerobot.config_scripted import HandrailScriptedConfig
from handrail.collect.lerobot.episode_clock import EpisodeClock, Phase
from handrail.collect.lerobot.mode_action import HOLD, NEXT
from handrail.collect.lerobot.stepwise import Stepwise
from handrail.collect.lerobot.teleoperator import SimTeleoperator
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.session.build import build_operator

_MARGIN = 2.0  # periods by which LeRobot's clock may be behind ours


class HandrailScripted(SimTeleoperator):
    """A script with a human-like hand steers `handrail_sim`; the same scene, the same motion.

    Args:
        config: its settings.

    Raises:
        HandrailError: one is wrong.
    """

    config_class = HandrailScriptedConfig
    name = "handrail_scripted"

    def __init__(self, config: HandrailScriptedConfig) -> None:
        config.check()
        super().__init__(config)
        self._config = config

    def _open(self, session: Stepwise) -> None:
        config = self._config
        who = replace(session.config, noise=config.noise, person=config.person)
        who.check()
        self._operator = build_operator(who, session.mode, session.env.model)
        self._clock = EpisodeClock(config.episode_time_s, config.reset_time_s, _MARGIN / session.fps)
        self._begun = 0

    def _act(self, session: Stepwise) -> dict[str, float]:
        phase = self._clock.phase(session.loop.done)
        if phase is not Phase.DRIVE:
            return session.action.still(session.gripper) | {NEXT if phase is Phase.NEXT else HOLD: 1.0}
        if session.episodes != self._begun:
            self._operator.reset(session.view, np.random.default_rng([session.seed, 1]))
            self._begun = session.episodes
        asked = self._operator.act(session.view)
        assert not isinstance(asked, EpisodeEvent)  # of which a script says none
        return session.action.action(asked, session.view.tool.rotation)
