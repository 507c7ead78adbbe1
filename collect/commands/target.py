"""Which folder a recording goes to, and what one can do with it then."""

import contextlib
import shutil
import sys
from dataclasses import replace
from pathlib import Path

from handrail.collect.commands.recording import open_writer
from handrail.collect.config import FoundDatasetConfig, RecordConfig
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.recording.folder import is_dataset

_TRIES = 100  # folders
_NEXT = """Next:
  {bin}handrail-inspect {root}    # what was recorded
  {bin}handrail-replay {root}    # do the same again
  {bin}handrail-train {root} --output outputs/policy"""


def located(config: RecordConfig, env: HandrailEnv) -> RecordConfig:
    """Return the settings of a recording with its folder, and whether it adds to a dataset that is there."""
    if config.dataset.is_found:
        return _found(config, env)
    goes_on = isinstance(config.dataset, FoundDatasetConfig) and not (config.resume or config.overwrite)
    if goes_on and is_dataset(Layout(config.dataset.folder.absolute())):
        return _resumed(config, env)
    return config


def _resumed(config: RecordConfig, env: HandrailEnv) -> RecordConfig:
    """Return the settings that add to the dataset that is there."""
    resumed = replace(config, resume=True)
    open_writer(resumed, env).close()
    return resumed


def _found(config: RecordConfig, env: HandrailEnv) -> RecordConfig:
    """Return the settings with the first folder that fits, where nobody said one.

    That is `outputs/cockpit/TASK` or the next one with a number: one that is free, or to which these episodes
    can be added.
    """
    first = config.dataset.folder / config.task.replace(":", "_")
    for folder in (first, *(first.with_name(f"{first.name}-{number}") for number in range(2, _TRIES))):
        there = replace(config, dataset=replace(config.dataset, place=str(folder)))
        if config.overwrite or not folder.exists():
            return there
        with contextlib.suppress(HandrailError):
            return _resumed(there, env)
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
