"""Scenes, tasks, the Gymnasium environments, operators and the session loop.

Importing it registers one environment a task, `handrail/<name>-v0`. The names of `__all__` are imported
from here: `from handrail.collect import SessionConfig, build_env, build_session`. Nothing heavy is loaded
until one of them is used or an environment is made.
"""

from typing import TYPE_CHECKING

import gymnasium

from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.lazy import lazily

if TYPE_CHECKING:
    from handrail.collect.commands.record import record as record
    from handrail.collect.commands.replay import replay_episode as replay_episode
    from handrail.collect.config import RecordConfig as RecordConfig
    from handrail.collect.config import SessionConfig as SessionConfig
    from handrail.collect.operators.modes import MODES as MODES
    from handrail.collect.session.build import build_env as build_env
    from handrail.collect.session.build import build_session as build_session
    from handrail.collect.session.session import Session as Session
    from handrail.collect.world.env import HandrailEnv as HandrailEnv

__all__, __getattr__ = lazily(__name__, __file__)  # pyright: ignore[reportUnsupportedDunderAll]

for _spec in TASKS.built_in:
    gymnasium.register(
        f"handrail/{str(_spec.task).rpartition(':')[2]}-v0",
        entry_point="handrail.collect.world.env:HandrailEnv",
        kwargs={"task": _spec.task},
    )

gymnasium.register("handrail/LeRobot-v0", entry_point="handrail.collect.lerobot.evaluated:EvaluatedEnv")
