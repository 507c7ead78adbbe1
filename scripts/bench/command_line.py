"""The command that gives the settings of a bench, as pages show it."""

from dataclasses import fields
from typing import Any

PROGRAM = "python -m handrail.scripts.bench"


def command_line(name: str, config: Any) -> str:
    """Return the command of a bench that gives these settings: the flags that differ from their defaults."""
    words = [PROGRAM, name]
    for entry in fields(config):
        value = getattr(config, entry.name)
        if isinstance(value, bool) and value != entry.default:
            words.append("--" + ("" if value else "no_") + entry.name)
        elif value != entry.default:
            words.append(f"--{entry.name} {value}")
    return " ".join(words)
