"""Which folder a recording goes to, and what one can do with it then."""

import contextlib
import shutil
import sys
from dataclasses import replace
from pathlib import Path

from handrail.collect.commands.recording import open_writer
from handrail.collect.config import RecordConfig
from handrail.collect.envs.env import HandrailEnv
from handrail.controllers.errors import HandrailError

_TRIES = 100  # folders
_NEXT = """Next:
  {bin}handrail-inspect {root}    # what was recorded
  {bin}handrail-replay {root}    # do the same again
  {bin}handrail-train {root} --output outputs/policy"""


def located(config: RecordConfig, env: HandrailEnv) -> RecordConfig:
    """Return the settings of a recording with its folder: where nobody said one, the first that fits.

    That is `outputs/cockpit/TASK` or the next one with a number: one that is free, or to which these episodes
    can be added.

    Raises:
        HandrailError: there is none.
    """
    if not config.dataset.is_found:
        return config
    first = config.dataset.folder / config.task.replace(":", "_")
    for folder in (first, *(first.with_name(f"{first.name}-{number}") for number in range(2, _TRIES))):
        there = replace(config, dataset=replace(config.dataset, place=str(folder)))
        if config.overwrite or not folder.exists():
            return there
        with contextlib.suppress(HandrailError), open_writer(replace(there, resume=True), env):
            return replace(there, resume=True)
    raise HandrailError(f"no folder for the dataset beside {str(first)!r}: say one")


def next_commands(root: Path) -> str:
    """Return what to try with a dataset."""
    here = Path.cwd()
    near = root.relative_to(here) if root.is_relative_to(here) else root
    return _NEXT.format(root=near, bin=command_prefix())


def command_prefix() -> str:
    """Return what to write before a command: nothing where the shell finds it, else the folder it is in."""
    if shutil.which("handrail-record"):
        return ""
    folder = Path(sys.executable).parent
    here = Path.cwd()
    return f"{folder.relative_to(here) if folder.is_relative_to(here) else folder}/"
