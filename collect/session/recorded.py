"""A recorded episode, run again: the settings that it keeps, and its commands as a controller."""

import json
from collections.abc import Collection, Mapping
from dataclasses import asdict, fields, replace
from typing import Any

from handrail.collect.config import SessionConfig
from handrail.collect.operators.catalogue import OPERATORS
from handrail.collect.operators.modes import MODES
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError, shown
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.typed import decoded

COLUMN = "settings"
_OLDER = {"environment": "task"} | {  # what an episode said before it kept every setting, and its name now
    name: name for name in ("robot", "operator", "mode", "noise", "person", "moving_obstacles")
}
_GONE = ("inner_error", "tremor")  # of a person, whom older episodes say more of than there is now
_FILE = ".toml"  # of a robot: a path, which is another one on another computer
_WHERE = "settings of the episode"
_NAMES = {"task": TASKS, "mode": MODES, "operator": OPERATORS, "robot": ROBOTS}


def settings_json(config: SessionConfig) -> str:
    """Return every setting of a session as JSON: who replays or reads its episodes needs no other source."""
    everything = asdict(config)
    return json.dumps({entry.name: everything[entry.name] for entry in fields(SessionConfig)})


def recorded_settings(row: Mapping[str, Any], said: Collection[str] = ()) -> SessionConfig:
    """Return the settings with which an episode was recorded.

    Args:
        row: the episode's line of metadata. An older one says only its task, its robot and a few more: the
            rest is as by default.
        said: the names of the command line; others that are `module:name` are refused. A description file
            of a robot takes the place of the recorded one.
    """
    config = unchecked_settings(row)
    if config.robot.endswith(_FILE):
        config = replace(config, robot=next((name for name in said if name.endswith(_FILE)), config.robot))
    for name, registry in _NAMES.items():
        registry.admit(getattr(config, name), said)
    config.check()
    return config


def unchecked_settings(row: Mapping[str, Any]) -> SessionConfig:
    """Return the settings of an episode whatever they name; nothing of it may be imported unless admitted."""
    content = _parsed(row[COLUMN]) if row.get(COLUMN) else _older(row)
    if isinstance(content, dict) and isinstance(content.get("human"), dict):
        content["human"] = {name: value for name, value in content["human"].items() if name not in _GONE}
    config = decoded(content, SessionConfig, _WHERE)
    if missing := {"task", "robot"} - set(content):
        raise HandrailError(f"{_WHERE}: expected entries task and robot, found no {', '.join(missing)}")
    return config


def _parsed(text: Any) -> Any:
    try:
        return json.loads(text)
    except (TypeError, ValueError, RecursionError) as error:
        raise HandrailError(f"{_WHERE}: expected JSON, got {shown(text)}") from error


def _older(row: Mapping[str, Any]) -> dict[str, Any]:
    if not row.get("environment"):
        raise HandrailError(f"{_WHERE}: found none; handrail-record writes them")
    return {ours: row[theirs] for theirs, ours in _OLDER.items() if row.get(theirs) not in (None, "")}
