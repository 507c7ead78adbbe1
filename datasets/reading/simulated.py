"""The columns of `handrail_sim` that `lerobot-record` keeps as entries of the robot's state."""

from collections.abc import Mapping

import numpy as np

from handrail.datasets.format.schema import NUMBERS, Feature

ROBOT, STATE, SUCCESS = "handrail_sim", "observation.state", "next.success"
_COLUMNS = {"success": SUCCESS, "distance": "controller.smallest_distance", "contacts": "safety.contacts"}
_SCENE = "scene"


def kept_in_state(robot: str, features: Mapping[str, Feature]) -> dict[str, int]:
    """Return the place in the state of each of Handrail's columns that is there."""
    if robot != ROBOT or STATE not in features or features[STATE].dtype not in NUMBERS:
        return {}
    names = [str(name).removesuffix(".pos").removesuffix(".number") for name in features[STATE].names or ()]
    columns = _COLUMNS | {_SCENE: _SCENE}
    return {column: names.index(name) for name, column in columns.items() if name in names}


def out_of_state(places: Mapping[str, int], frames: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the columns, `(N,)` each; success is true where it began, for it outlasts a scene.

    Only that of the scene in the middle counts: the others are of episodes before and after.

    Args:
        places: As `kept_in_state` returns them.
        frames: Of one episode, with its state.
    """
    if not places:
        return {}
    state = frames[STATE].reshape(len(frames[STATE]), -1)
    found = {column: state[:, place] for column, place in places.items()}
    scene = found.pop(_SCENE, np.zeros(len(state)))
    if SUCCESS in found:
        began, middle = np.diff(found[SUCCESS], prepend=found[SUCCESS][:1]) > 0, len(scene) // 2
        found[SUCCESS] = began & (scene == scene[middle : middle + 1])
    return found
