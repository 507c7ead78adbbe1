"""The origin of a policy's episodes, as their rows say: task, its sentence, mode, robot, hand and time.

A row may name a `module:name`; it is read, and nothing that it names is imported.
"""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

from handrail.collect.config import SessionConfig
from handrail.collect.session.build import build_task
from handrail.collect.session.recorded import COLUMN, unchecked_settings
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.description import load_description
from handrail.datasets.reading.reader import DatasetInfo
from handrail.policies.imitation.interface.checkpoint import MIXED


def origin_of(info: DatasetInfo, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return `environment`, `task`, `mode`, `robot`, `hand` and `time_limit`, as a policy keeps them.

    "mixed" of several, but no `task` of several; "" and 0 where they do not say. A robot that is the path
    of a file is called as the dataset calls it.
    """
    recorded = _recorded(rows)
    found = {name: {str(row.get(name) or "") for row in rows} for name in ("environment", "mode", "robot")}
    found["hand"] = {hand_of(each) for each in recorded} or {""}
    origin = {name: each.pop() if len(each) == 1 else MIXED for name, each in found.items()}
    robot = origin["robot"]
    if not robot or "/" in robot or robot.endswith(".toml"):
        origin["robot"] = re.sub(r"[^\w+:,.\- ]", "-", info.robot_type)
    sentences = {"; ".join(row.get("tasks") or []) for row in rows}
    task = sentences.pop() if len(sentences) == 1 else ""
    return origin | {"task": task, "time_limit": _time_limit(recorded)}


def hand_of(config: SessionConfig) -> str:
    """Return which hand did it; empty of a robot that has one, or that is not there."""
    with suppress(HandrailError):
        ROBOTS.admit(config.robot)
        return config.hand or load_description(config.robot).hands[0].name
    return config.hand


def _recorded(rows: Sequence[Mapping[str, Any]]) -> list[SessionConfig]:
    """Return the settings of episodes, each once; none if one does not say."""
    with suppress(HandrailError):
        return [unchecked_settings(row) for row in {str(row.get(COLUMN)): row for row in rows}.values()]
    return []


def _time_limit(recorded: Sequence[SessionConfig]) -> float:
    """Return the longest time that episodes were given [s]; 0 for the task's own, or if one does not say."""
    with suppress(HandrailError):
        if any(each.time_limit for each in recorded):
            return float(max(each.time_limit or _own_time(each) for each in recorded))
    return 0.0


def _own_time(config: SessionConfig) -> float:
    TASKS.admit(config.task)
    return build_task(config).time_limit
