"""The robots by name; light to import."""

from dataclasses import dataclass
from pathlib import Path

from handrail.controllers.registry import Registry


@dataclass(frozen=True)
class RobotSpec:
    """A robot: one description file makes it."""

    name: str  # as on the command line
    file: Path  # its description; `robots/ridgeback_ur10.toml` explains the format
    help: str = ""  # one line


def _spec(path: Path) -> RobotSpec:
    """Return the entry of a description; its first line, a comment, is the line of help."""
    return RobotSpec(path.stem, path, path.read_text("utf-8").partition("\n")[0].strip("# ."))


ROBOTS = Registry("robot", RobotSpec, map(_spec, sorted((Path(__file__).parent / "robots").glob("*.toml"))))
