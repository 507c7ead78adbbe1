"""Checks an installed wheel from outside the repository: every module and every data file is there.

python use_wheel.py REPOSITORY    compare with the repository
python use_wheel.py --commands    print the commands
"""

import importlib
import sys
import tomllib
from importlib import metadata
from pathlib import Path

# imported at the top of modules that only an extra's users import
EXTRAS = ("accelerate", "stable_baselines3", "mink", "uvicorn", "starlette", "websockets")
FOLDERS = ("collect", "controllers", "datasets", "policies", "scripts")


def commands() -> list[str]:
    """Return the commands that the wheel installs."""
    entries = metadata.distribution("handrail").entry_points
    return sorted(entry.name for entry in entries if entry.group == "console_scripts")


def load(module: str) -> None:
    """Import a module; one that needs an extra which is not installed here may say so.

    Raises:
        ModuleNotFoundError: something else is missing.
    """
    try:
        importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name not in EXTRAS:
            raise


def check(repository: Path) -> None:
    """Import every module and compare the files with the repository's.

    Raises:
        SystemExit: something is missing, or is imported from the repository itself.
    """
    home = Path(importlib.import_module("handrail.controllers").__file__ or "").parents[1]
    if home.is_relative_to(repository):
        sys.exit(f"handrail is imported from {home}, expected the installed wheel")
    for path in sorted(file for folder in FOLDERS for file in (repository / folder).rglob("*")):
        if not path.is_file() or "__pycache__" in path.parts:
            continue
        inside = path.relative_to(repository)
        if not (home / inside).is_file():
            sys.exit(f"the wheel lacks {inside}: list its package or its data files in pyproject.toml")
        if path.suffix == ".py" and path.stem != "__init__":
            load(".".join(("handrail", *inside.with_suffix("").parts)))
    declared = tomllib.loads((repository / "pyproject.toml").read_text())["project"]["scripts"]
    if commands() != sorted(declared):
        sys.exit(f"commands: expected {sorted(declared)}, got {commands()}")


if __name__ == "__main__":
    if sys.argv[1:] == ["--commands"]:
        print(*commands(), sep="\n")
    else:
        check(Path(sys.argv[1]).resolve())
