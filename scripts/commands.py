"""The commands, as `commands.toml` lists them; a command imports its own parts alone."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handrail.controllers.registry import resolved


@dataclass(frozen=True)
class Verb:
    """The work of a command, or of one of its words."""

    help: str
    """One line."""
    settings: str
    """`module:name` of the dataclass that its command line becomes; light to import."""
    body: str
    """`module:name` of `(settings) -> exit code or None`."""

    @property
    def config(self) -> type[Any]:
        """The class of its settings."""
        return resolved(f"handrail.{self.settings}")

    def run(self, config: Any) -> int | None:
        """Do it as configured; return the exit code."""
        if callable(check := getattr(config, "check", None)):
            check()
        return resolved(f"handrail.{self.body}")(config)


@dataclass(frozen=True)
class Program:
    """One command: `handrail-NAME`, or `handrail NAME`."""

    help: str
    """One line."""
    verbs: Mapping[str, Verb]
    """Its verbs by their words; a command without words has one under the empty word."""


def _program(entry: Any) -> Program:
    """Return a command as the table has it: one verb, or a line of help and verbs."""
    if isinstance(entry, list):
        return Program(entry[0], {"": Verb(*entry)})
    return Program(entry["help"], {name: Verb(*verb) for name, verb in entry["verbs"].items()})


_TABLE = tomllib.loads((Path(__file__).parent / "commands.toml").read_text(encoding="utf-8"))
GROUPS: Mapping[str, Mapping[str, Program]] = {
    group: {name: _program(entry) for name, entry in commands.items()} for group, commands in _TABLE.items()
}
COMMANDS = {name: command for group in GROUPS.values() for name, command in group.items()}
