"""The settings of a session, as every episode that came of it keeps them."""

import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

from handrail.collect.config import SessionConfig
from handrail.collect.operators.human import HumanSettings
from handrail.controllers.errors import HandrailError

COLUMN = "settings"
_OLDER = {"environment": "task"} | {  # what an episode said before it kept every setting, and its name now
    name: name for name in ("robot", "operator", "mode", "noise", "person", "moving_obstacles")
}


def settings_json(config: SessionConfig) -> str:
    """Return every setting of a session as JSON: who replays or reads its episodes needs no other source."""
    everything = asdict(config)
    return json.dumps({entry.name: everything[entry.name] for entry in fields(SessionConfig)})


def recorded_settings(row: Mapping[str, Any]) -> SessionConfig:
    """Return the settings with which an episode was recorded.

    Args:
        row: the episode's line of metadata. An older one says only its task, its robot and a few more: the
            rest is as by default.

    Raises:
        HandrailError: it says no settings of a session, or wrong ones.
    """
    settings = _parsed(row[COLUMN]) if row.get(COLUMN) else _older(row)
    try:
        human = HumanSettings(**settings.pop("human", {}))
        config = SessionConfig(**settings, human=human)
    except (TypeError, ValueError) as error:
        raise _wrong(error) from error
    _check_types(config)
    config.check()
    return config


def _parsed(text: Any) -> dict[str, Any]:
    try:
        settings = json.loads(text)
    except (TypeError, ValueError, RecursionError) as error:
        raise _wrong(f"expected JSON, got {text!r:.80}") from error
    if not isinstance(settings, dict) or not {"task", "robot"} <= set(settings):
        raise _wrong(f"expected a JSON object with task, robot, …, got {text!r:.80}")
    return settings


def _older(row: Mapping[str, Any]) -> dict[str, Any]:
    if not row.get("environment"):
        raise _wrong("found none; handrail-record writes them")
    return {ours: row[theirs] for theirs, ours in _OLDER.items() if row.get(theirs) not in (None, "")}


def _check_types(config: SessionConfig) -> None:
    for entry in fields(SessionConfig):
        value, kind = getattr(config, entry.name), type(getattr(SessionConfig(), entry.name))
        if type(value) is not kind and not (kind is float and type(value) is int):
            raise _wrong(f"expected {entry.name} to be {kind.__name__}, got {value!r:.80}")


def _wrong(why: object) -> HandrailError:
    return HandrailError(f"settings of the episode: {why}")
