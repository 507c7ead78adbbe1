"""Episodes of a made-up robot whose actions are known functions of what is seen and of what is not."""

from pathlib import Path

import numpy as np
import pytest

from handrail.datasets.demonstrations.demonstration import Demonstration
from handrail.datasets.format.schema import Feature
from handrail.datasets.reading.reader import DatasetInfo

STATE = ("x.pos", "y.pos", "theta.pos", "elbow.pos", "elbow.vel")
ACTION = ("v_x", "v_y", "v_theta", "v_elbow", "gripper")


@pytest.fixture(scope="session")
def episodes():
    """Return what makes a group of episodes of a function of state, hidden number and noise to the action."""
    return make


def make(act, count=20, frames=30, units=1.0, seed=3, phase=None):
    """Return episodes; `act(state, seen, hidden, rng)` gives `(N, 5)`; `seen` is `(N, 4)`, `hidden` ±1."""
    rng = np.random.default_rng(seed)
    return [_episode(number, act, frames + number % 4, units, rng, phase) for number in range(count)]


def _episode(number, act, frames, units, rng, phase):
    state = rng.normal(size=(frames, len(STATE)))
    seen, hidden = rng.normal(size=(frames, 4)), float(rng.choice([-1.0, 1.0]))
    action = act(state, seen, hidden, rng) * units
    columns = {"observation.state": state, "observation.environment_state": seen, "action": action}
    names = {"observation.state": STATE, "observation.environment_state": tuple("abcd"), "action": ACTION}
    if phase:
        columns["phase"] = np.array([phase(place / frames) for place in range(frames)])
    features = {
        name: Feature("string" if name == "phase" else "float32", (values[0].size,), names.get(name))
        for name, values in columns.items()
    }
    info = DatasetInfo(Path("one"), 10, "made up", features, 1, 1, "", "", from_handrail=False)
    return Demonstration(number, info, columns, {"length": frames, "tasks": ["go"]})
