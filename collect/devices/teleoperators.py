"""LeRobot's teleoperators by name: their settings from our flags, made by LeRobot itself."""

import contextlib
import importlib
import pkgutil
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from handrail.collect.teleop_config import LeaderConfig
from handrail.controllers.errors import HandrailError, message_of, unknown_name

if TYPE_CHECKING:
    from lerobot.teleoperators.teleoperator import Teleoperator


def make_teleoperator(config: LeaderConfig) -> "Teleoperator":
    """Return LeRobot's teleoperator of the settings, not connected.

    Also of installed packages whose names begin with `lerobot_teleoperator_`.
    """
    import draccus
    from lerobot.teleoperators.utils import make_teleoperator_from_config

    known = leader_types()
    if config.type not in known:
        raise unknown_name("--teleop.type", config.type, known)
    try:
        settings = draccus.decode(known[config.type], _settings(config))
        return make_teleoperator_from_config(settings)
    except Exception as error:  # whatever a driver's code raises
        raise HandrailError(f"--teleop.type {config.type}: {message_of(error)}") from error


def leader_types() -> Mapping[str, Any]:
    """Return the settings of every type of LeRobot's teleoperators, by its name."""
    from lerobot.teleoperators.config import TeleoperatorConfig
    from lerobot.utils.import_utils import register_third_party_plugins

    _import_all()
    register_third_party_plugins()
    return TeleoperatorConfig.get_known_choices()


def _import_all() -> None:
    """Let LeRobot's own teleoperators register; those whose drivers are not installed cannot."""
    import lerobot.teleoperators

    for module in pkgutil.iter_modules(lerobot.teleoperators.__path__):
        with contextlib.suppress(ImportError):
            importlib.import_module(f"lerobot.teleoperators.{module.name}")


def _settings(config: LeaderConfig) -> dict[str, Any]:
    """Return what LeRobot's settings are made of."""
    given = {name: value for name in ("port", "id") if (value := getattr(config, name))}
    for option in filter(None, (part.strip() for part in config.options.split(","))):
        name, equals, value = option.partition("=")
        if not equals or not name.isidentifier():
            raise HandrailError(
                f"--teleop.options {config.options}: expected name=value with commas between, got {option}"
            )
        given[name] = value
    return given
