"""Makes a robot of a URDF, and checks robots."""

import shlex
import time
from pathlib import Path

from handrail.collect.config import SessionConfig
from handrail.collect.robot_config import CheckRobotConfig, NewRobotConfig
from handrail.collect.session.build import build_env
from handrail.controllers.errors import FAILED, HandrailError
from handrail.controllers.modelling.checks import faults
from handrail.controllers.modelling.making import RobotMaker
from handrail.controllers.modelling.source import Source
from handrail.controllers.modelling.toml_text import toml_text
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.printable import printable
from handrail.datasets.storage.atomic import write_whole

_HEAD = "# Made by handrail-robot new: look at these guesses, then delete the lines.\n"


def new_robot(config: NewRobotConfig) -> int:
    """Write a description; return the exit code."""
    began, source, say = time.monotonic(), Source.find(config.urdf), Terminal().print
    if not config.hands:
        raise HandrailError(
            f"--hands: expected the link at the end of the hand, such as one of {', '.join(source.ends())}"
        )
    path = _output(config, source)
    made = RobotMaker(
        source, config.name, config.frames, config.base, tuple(filter(None, config.joints.split(",")))
    ).make()
    guesses = "".join(f"#   {printable(guess)}\n" for guess in made.guesses)
    write_whole(path, f"{_HEAD}{guesses}{toml_text(made.tables)}".encode())
    for guess in made.guesses:
        say(f"look at  {guess}")
    model = made.model()
    robot = model.description
    say(
        f"wrote {path} in {time.monotonic() - began:.0f} s: {model.size} degrees of freedom, "
        f"{len(robot.collision)} shapes, {len(robot.self_pairs)} pairs that can meet; "
        f"next: handrail-robot check {shlex.quote(str(path))} --picture robot.png"
    )
    return 0


def _output(config: NewRobotConfig, source: Source) -> Path:
    """Return where the description goes: above the URDF, unless that is in an installed package."""
    path = Path(config.output).expanduser() if config.output else source.folder / f"{config.name}.toml"
    if Path(config.urdf).expanduser().is_file() and path.resolve().parent != source.folder:
        raise HandrailError(
            f"--output {path}: expected a file in {source.folder}, where the URDF's meshes start from"
        )
    if path.exists() and not config.overwrite:
        raise HandrailError(f"{path}: there is one already; --overwrite replaces it")
    return path


def check_robot(config: CheckRobotConfig) -> int:
    """Print what is wrong with a robot, draw it; return the exit code."""
    found, say = faults(config.robot), Terminal().print
    try:
        build_env(SessionConfig(task="reach", robot=config.robot), 20).reset(seed=0)
    except HandrailError as error:
        found = found or [str(error)]
    for fault in found:
        say(fault)
    if config.picture:
        from handrail.collect.world.robot_picture import draw_robot

        draw_robot(config.robot, Path(config.picture).expanduser())
        say(f"drew {config.picture}")
    if not found:
        say(f"{config.robot}: nothing is wrong")
    return FAILED if found else 0
