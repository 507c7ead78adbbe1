"""Demonstrations as Handrail's policies read and write them, for measures of data on the floor below."""

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.datasets.demonstrations.demonstration import Demonstration
from handrail.datasets.learnability.candidates import BASE_POSE
from handrail.datasets.learnability.policy_rows import Actions, PolicyRows, recorded_view
from handrail.policies.imitation.interface.interface import (
    COLUMNS,
    ENVIRONMENT,
    STATE,
    PolicyInterface,
)

_BASE = ("base.x", "base.y", "base.cos", "base.sin")
_VALUES, _MASK = "teleop.values", "teleop.mask"


def policy_rows(episode: Demonstration) -> PolicyRows:
    """Return what Handrail's policies read and write in an episode; of other datasets what is recorded.

    In the action space `intent` are all channels, zero where the operator did not own them.

    Raises:
        DoesNotApply: There is no observation or no action with numbers.
    """
    features, columns = episode.info.features, episode.frames
    if not set(COLUMNS) <= set(columns):
        return recorded_view(episode)
    try:
        seen = PolicyInterface.of_dataset(features, [], "realised")
        state, environment = columns[STATE].astype(float), columns[ENVIRONMENT].astype(float)
        rows = np.hstack(seen.observe(state, environment)).astype(float)
        everything = (True,) * len(seen.channels)
        asked = PolicyInterface(
            "intent", seen.state_names, seen.environment_names, seen.channels, (everything,)
        )
        given = {**columns, _VALUES: np.where(columns[_MASK], columns[_VALUES], 0.0)}
        actions = {
            each.actions: Actions(each.action_names, each.encode(given).astype(float))
            for each in (seen, asked)
        }
    except HandrailError:
        return recorded_view(episode)
    names = [name for part in seen.observation_names for name in part]
    base = tuple(place for place, name in enumerate(names) if name in _BASE)
    return PolicyRows(rows, actions, {BASE_POSE: base} if base else {})
