"""Which episodes a policy is trained on, and how much of an operator's time they took."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handrail.controllers.errors import HandrailError, check_known
from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.interface.checkpoint import PolicyMeta

Row = Mapping[str, Any]
_MINUTE = 60.0
_FEWEST_HELD_OUT = 5  # episodes


@dataclass(frozen=True)
class Selection:
    """Episodes to train on."""

    rows: tuple[Row, ...]
    """Their lines of metadata, in the order of the dataset."""
    attempts: int
    """Number of episodes that it took, failed ones included."""
    operator_time: float
    """Simulated length of all attempts [s]."""


def select(rows: Sequence[Row], fps: float, config: TrainConfig) -> Selection:
    """Return the episodes that a config asks for.

    All attempts of the mode are put into a random order that depends on `draw` alone, and are taken from the
    front until there are enough: the operator would have had to make the failed ones too.
    """
    attempts = _attempts(rows, config)
    kept: list[Row] = []
    taken, frames, most = 0, 0, config.minutes * _MINUTE * fps * (1.0 + 1e-9)
    for place in np.random.default_rng(config.draw).permutation(len(attempts)):
        attempt = attempts[place]
        if config.minutes and frames + attempt["length"] > most:
            break
        taken, frames = taken + 1, frames + attempt["length"]
        if not config.success_only or attempt.get("success"):
            kept.append(attempt)
        if len(kept) == config.episodes > 0:
            break
    else:
        minutes = frames / fps / _MINUTE
        if config.minutes and minutes < config.minutes * (1.0 - 1e-9):
            raise HandrailError(f"--minutes {config.minutes:g}: expected at most the {minutes:.2f} recorded")
        if config.episodes and not config.minutes:
            raise HandrailError(f"--episodes {config.episodes}: expected at most the {len(kept)} there are")
    if not kept:
        raise HandrailError(f"no episode left to train on, of {len(attempts)}: expected one or more")
    return Selection(tuple(sorted(kept, key=lambda row: row["episode_index"])), taken, frames / fps)


def select_again(rows: Sequence[Row], began: PolicyMeta) -> Selection:
    """Return the episodes that a training began with, whatever the dataset has gained since."""
    there = {row["episode_index"]: row for row in rows}
    if not began.episodes:
        raise HandrailError("--resume: expected a checkpoint that says its episodes, got an older one")
    if missing := [number for number in began.episodes if number not in there]:
        words = f"expected the episodes of before; the dataset has no episode {missing[0]}"
        raise HandrailError(f"--resume: {words}")
    kept, how = tuple(there[number] for number in began.episodes), began.trained_on
    return Selection(kept, int(how.get("attempts", 0)), how.get("operator_time", 0.0))


def hold_out(rows: Sequence[Row], config: TrainConfig) -> tuple[list[Row], list[Row]]:
    """Return the episodes to learn from, and those that are held out, drawn by `draw` alone."""
    if not config.eval_split:
        return list(rows), []
    count = max(_FEWEST_HELD_OUT, math.ceil(config.eval_split * len(rows)))
    if count >= len(rows):
        words = f"expected more than {count} episodes, to hold {count} out; got {len(rows)}"
        raise HandrailError(f"--eval_split {config.eval_split:g}: {words}")
    chosen = set(np.random.default_rng([config.draw, 1]).permutation(len(rows))[:count].tolist())
    held_out = [row for place, row in enumerate(rows) if place in chosen]
    return [row for place, row in enumerate(rows) if place not in chosen], held_out


def _attempts(rows: Sequence[Row], config: TrainConfig) -> list[Row]:
    if config.mode and any(row.get("mode") is None for row in rows):
        raise HandrailError("--mode: expected episodes that say their mode; these do not")
    if config.success_only and any(row.get("success") is None for row in rows):
        raise HandrailError("--success_only: expected episodes that say whether they succeeded; these do not")
    modes = {str(row.get("mode")) for row in rows}
    if config.mode:
        check_known("mode in the dataset", (config.mode,), modes)
    return [row for row in rows if not config.mode or row["mode"] == config.mode]
