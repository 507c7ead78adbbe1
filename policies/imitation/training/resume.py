"""Going on with a training: only with the settings, the sizes and the data that it began with."""

import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.config import FREE_ON_RESUME, TrainConfig
from handrail.policies.imitation.interface.checkpoint import PolicyMeta
from handrail.policies.imitation.training.presets import resolved

if TYPE_CHECKING:
    from handrail.policies.imitation.training.source import TrainingSource

_OLDER = {"base_pose": False, "scene": True}  # of a training before that could be said


def check_settings(config: TrainConfig, began: PolicyMeta) -> None:
    """Check that settings are those of a checkpoint, and its sizes still those of the preset."""
    now, then = as_json(config), _OLDER | dict(began.training)
    for entry in fields(config):
        if entry.name not in FREE_ON_RESUME and entry.name in then:
            _check_same(f"--{entry.name}", now[entry.name], then[entry.name])
    sizes = as_json(resolved(config))
    least = began.sizes.get("steps", began.steps)
    if sizes["steps"] < least:
        raise HandrailError(
            f"--resume with --steps {sizes['steps']}: expected {least} or more, as the training began"
        )
    for name in ("lr", "cosine", "batch_size"):
        _check_same(f"the preset's {name}", sizes[name], began.sizes.get(name, sizes[name]))
    options = began.sizes.get("options", sizes["options"])
    for name in sorted(options.keys() | sizes["options"].keys()):
        _check_same(f"the policy's {name}", sizes["options"].get(name), options.get(name))


def check_data(source: "TrainingSource", began: PolicyMeta) -> None:
    """Check that what is read is what a checkpoint learnt from.

    A checkpoint of an earlier version says nothing of pictures, or only how many episodes and how long.
    """
    same = source.digest.startswith(began.data) if began.data else source.trained_on == began.trained_on
    if not same:
        raise HandrailError(
            f"--resume with --dataset.root {source.info.root}: expected the "
            f"{began.trained_on.get('episodes', 0):g} episodes that the training began with, got others"
        )


def as_json(settings: Any) -> Mapping[str, Any]:
    """Return the fields of a dataclass as they come back from a file."""
    return json.loads(json.dumps(asdict(settings)))


def _check_same(what: str, now: Any, then: Any) -> None:
    if now != then:
        raise HandrailError(f"--resume with {what} {now}: expected {then} as the training began")
