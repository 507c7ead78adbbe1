"""The robots by name; light to import."""

from dataclasses import dataclass
from pathlib import Path

from handrail.controllers.registry import Registry

_FOLDER = Path(__file__).parent / "robots"


@dataclass(frozen=True)
class RobotSpec:
    """A robot: one description file makes it."""

    name: str  # as on the command line
    file: Path  # its description; `robots/ridgeback_ur10.toml` explains the format
    help: str = "comes with Handrail"  # one line


ROBOTS = Registry("robot", RobotSpec, (RobotSpec(path.stem, path) for path in sorted(_FOLDER.glob("*.toml"))))
