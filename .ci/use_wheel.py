"""Checks an installed wheel from outside the repository: every module and every data file is there.

python use_wheel.py REPOSITORY    compare with the repository
python use_wheel.py --commands    print the commands
python use_wheel.py --found       check that LeRobot's commands find Handrail's plugins by themselves
"""

import importlib
import sys
import tomllib
from importlib import metadata
from pathlib import Path

# imported at the top of modules that only an extra's users import
EXTRAS = ("accelerate", "stable_baselines3", "mink", "ray", "uvicorn", "starlette", "websockets")
EXTRAS += ("cryptography",)
FOLDERS = ("collect", "controllers", "datasets", "policies", "scripts")
BENCHES = Path("scripts/bench")  # of a clone alone


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


def check_found() -> None:
    """Let LeRobot discover installed plugins as its commands do, and look for ours among what it knows then.

    Raises:
        SystemExit: one is missing.
    """
    utils = importlib.import_module("lerobot.utils.import_utils")
    utils.register_third_party_plugins()
    known = {
        "lerobot.robots:RobotConfig": ("handrail_sim",),
        "lerobot.teleoperators:TeleoperatorConfig": (
            "handrail_scripted",
            "handrail_cockpit",
            "handrail_gamepad",
        ),
        "lerobot.envs.configs:EnvConfig": ("handrail",),
    }
    for place, names in known.items():
        module, _, kind = place.partition(":")
        choices = getattr(importlib.import_module(module), kind).get_known_choices()
        if missing := [name for name in names if name not in choices]:
            sys.exit(f"{kind}: expected {', '.join(missing)} of lerobot_robot_handrail, got {list(choices)}")
    steps = importlib.import_module("lerobot.processor").ProcessorStepRegistry.list()
    if "handrail_policy_view" not in steps:
        sys.exit(f"steps: expected handrail_policy_view, got {steps}")


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
        if inside.is_relative_to(BENCHES):
            continue
        if not (home / inside).is_file():
            sys.exit(f"the wheel lacks {inside}: list its package or its data files in pyproject.toml")
        if path.suffix == ".py" and path.stem != "__init__":
            load(".".join(("handrail", *inside.with_suffix("").parts)))
    if (home / BENCHES).exists():
        sys.exit(f"the wheel has {BENCHES}, which measures and is not the product")
    declared = tomllib.loads((repository / "pyproject.toml").read_text())["project"]["scripts"]
    if commands() != sorted(declared):
        sys.exit(f"commands: expected {sorted(declared)}, got {commands()}")


if __name__ == "__main__":
    if sys.argv[1:] == ["--commands"]:
        print(*commands(), sep="\n")
    elif sys.argv[1:] == ["--found"]:
        check_found()
    else:
        check(Path(sys.argv[1]).resolve())
