"""The features of a policy of recorded columns: whether they are those of its robot and its task."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypedDict

from handrail.collect.config import CAMERAS, MOST_MOVING, SessionConfig
from handrail.collect.session.build import build_mode, build_task
from handrail.collect.world.observation import AgentObservation
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.model import load_model
from handrail.controllers.typed import Count, check
from handrail.policies.imitation.interface.interface import ACTION, ENVIRONMENT, STATE

if TYPE_CHECKING:
    from handrail.collect.lerobot.mode_action import ModeAction

_IMAGES = "observation.images."


class _Shaped(TypedDict):
    shape: tuple[Count, ...]


def pictures(settings: Mapping[str, Any], where: str) -> dict[str, tuple[int, int]]:
    """Return height and width of what a policy sees, by camera [px].

    Args:
        settings: of the policy.
        where: it is, for the error.
    """
    found = {}
    for name, shape in _shapes(settings, "input_features", where).items():
        if name.startswith(_IMAGES):
            if len(shape) != 3:
                raise HandrailError(f"{where}: {name}: expected channels, height and width, got {shape}")
            found[name.removeprefix(_IMAGES)] = shape[1:]
    return found


def movers_of(settings: Mapping[str, Any], where: str, robot: str, task: str, mode: str) -> tuple[int, bool]:
    """Return of how many moving obstacles a policy knows, and whether it reads robot and scene as one vector.

    Args:
        settings: of the policy.
        where: it is, for the error.
        robot: its robot.
        task: its task.
        mode: the teleop mode whose channels it writes; empty for joint velocities.
    """
    given, model = _sizes(settings, where), load_model(robot)
    state = len(AgentObservation(model).names)
    action = len(action_of(mode, robot, task).names) if mode else model.size + 1
    known: list[dict[str, int]] = []
    for movers in range(MOST_MOVING + 1 if TASKS.find(task).movers else 1):
        scene = len(build_task(SessionConfig(task=task, moving_obstacles=movers)).state_names)
        apart = {STATE: state, ENVIRONMENT: scene, ACTION: action}
        joined = {STATE: state + scene, ACTION: action}
        for sizes in (apart, joined) if mode else (apart,):
            if given.items() <= sizes.items():
                return movers, sizes is joined
            known.append(sizes)
    raise HandrailError(f"{where}: expected the features of {robot} in {task}, {known}, got {given}")


def _sizes(settings: Mapping[str, Any], where: str) -> dict[str, int]:
    """Return the sizes of what a policy reads and writes, but for pictures."""
    read = _shapes(settings, "input_features", where)
    written = _shapes(settings, "output_features", where)
    for camera in (name.removeprefix(_IMAGES) for name in read if name.startswith(_IMAGES)):
        if camera not in CAMERAS:
            raise HandrailError(f"{where}: reads the camera {camera!r}: expected one of {', '.join(CAMERAS)}")
    numbers = {name: shape for name, shape in read.items() if not name.startswith(_IMAGES)} | written
    others = sorted(numbers.keys() - {STATE, ENVIRONMENT, ACTION})
    if others or ACTION not in written:
        raise HandrailError(
            f"{where}: expected a policy that reads {STATE}, {ENVIRONMENT} and cameras, and writes {ACTION};"
            f" got {', '.join(others) or 'no action'}"
        )
    for name, shape in numbers.items():
        if len(shape) != 1:
            raise HandrailError(f"{where}: {name}: expected one dimension, got {shape}")
    return {name: shape[0] for name, shape in numbers.items()}


def _shapes(settings: Mapping[str, Any], which: str, where: str) -> dict[str, tuple[int, ...]]:
    features = check(settings.get(which) or {}, dict[str, _Shaped], f"{where}: {which}")
    return {name: feature["shape"] for name, feature in features.items()}


def action_of(mode: str, robot: str, task: str) -> "ModeAction":
    """Return what the numbers of an action of a teleop mode are, as `lerobot-record` records them."""
    from handrail.collect.lerobot.mode_action import ModeAction

    model = load_model(robot)
    return ModeAction(build_mode(SessionConfig(task=task, mode=mode), model), Channels.of(model.description))
