"""Where things lie in the repository."""

from pathlib import Path

HELPERS = Path(__file__).parent
ROOT = HELPERS.parent.parent
FLOORS = ("controllers", "datasets", "collect", "policies", "scripts")  # from the ground up


def sources(floor: str) -> list[Path]:
    """Return the Python files of a floor."""
    return sorted(path for path in (ROOT / floor).rglob("*.py") if "__pycache__" not in path.parts)
