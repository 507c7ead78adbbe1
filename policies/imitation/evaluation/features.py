"""What a policy that reads and writes recorded columns can drive: its features say which robot and task.

So does any policy of plain `lerobot-train`: the sizes of `observation.state`, `observation.environment_state`
and `action` are those of one robot and one task, or of none.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from handrail.collect.config import CAMERAS, MOST_MOVING, SessionConfig
from handrail.collect.session.build import build_mode, build_task
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.entries import is_count
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.description import load_description, robot_names
from handrail.controllers.robot.model import load_model
from handrail.policies.imitation.interface.interface import ACTION, ENVIRONMENT, STATE

if TYPE_CHECKING:
    from handrail.collect.lerobot.mode_action import ModeAction

IMAGES = "observation.images."


@dataclass(frozen=True)
class Place:
    """Where a policy belongs.

    Attributes:
        robot: its name.
        task: its name.
        movers: how many obstacles move.
        sizes: of `observation.state`, `observation.environment_state` and `action`.
        joined: whether the scene is in `observation.state` too, as `lerobot-record` records it.
    """

    robot: str
    task: str
    movers: int
    sizes: Mapping[str, int]
    joined: bool = False


def pictures(settings: Mapping[str, Any], where: str) -> dict[str, tuple[int, int]]:
    """Return height and width of what a policy sees, by camera [px].

    Args:
        settings: of the policy.
        where: it is, for the error.
    """
    shapes = _shapes(settings, "input_features", where)
    found = {name: shape for name, shape in shapes.items() if name.startswith(IMAGES)}
    for name, shape in found.items():
        if len(shape) != 3:
            raise HandrailError(f"{where}: {name}: expected channels, height and width, got {list(shape)}")
    return {name.removeprefix(IMAGES): (height, width) for name, (_, height, width) in found.items()}


def place_of(
    settings: Mapping[str, Any], where: str, robot: str = "", task: str = "", mode: str = ""
) -> Place:
    """Return where a policy belongs that reads and writes recorded columns.

    Args:
        settings: of the policy.
        where: it is, for the error.
        robot: its robot, where that is known.
        task: its task, where that is known.
        mode: the teleop mode whose channels it writes; empty for joint velocities.
    """
    given = _sizes(settings, where)
    known = list(_places((robot,) if robot else robot_names(), (task,) if task else TASKS, mode))
    found = [place for place in known if all(place.sizes.get(name) == size for name, size in given.items())]
    if ENVIRONMENT not in given:
        found = [place for place in found if place.joined or not place.movers]
    if not found:
        raise HandrailError(
            f"{where}: expected the features of a task ({'; '.join(dict.fromkeys(map(_words, known)))}), "
            f"got {_sizes_in_words(given)}"
        )
    if len(found) > 1:
        several = {
            name: list(dict.fromkeys(getattr(place, name) for place in found)) for name in ("task", "robot")
        }
        words = " and ".join(
            f"--{name} with one of {', '.join(each)}" for name, each in several.items() if len(each) > 1
        )
        raise HandrailError(f"{where}: expected {words}; its features do not say which")
    return found[0]


def _sizes(settings: Mapping[str, Any], where: str) -> dict[str, int]:
    """Return the sizes of what a policy reads and writes, but for pictures."""
    read = _shapes(settings, "input_features", where)
    written = _shapes(settings, "output_features", where)
    for camera in (name.removeprefix(IMAGES) for name in read if name.startswith(IMAGES)):
        if camera not in CAMERAS:
            raise HandrailError(f"{where}: reads the camera {camera!r}: expected one of {', '.join(CAMERAS)}")
    numbers = {name: shape for name, shape in read.items() if not name.startswith(IMAGES)}
    if others := [*(numbers.keys() - {STATE, ENVIRONMENT}), *(written.keys() - {ACTION})]:
        raise HandrailError(
            f"{where}: expected a policy that reads {STATE}, {ENVIRONMENT} and cameras, and writes {ACTION};"
            f" got {', '.join(sorted(others))}"
        )
    if ACTION not in written:
        raise HandrailError(f"{where}: expected a policy that writes {ACTION}, got none")
    for name, shape in (numbers | written).items():
        if len(shape) != 1:
            raise HandrailError(f"{where}: {name}: expected one dimension, got {list(shape)}")
    return {name: shape[0] for name, shape in (numbers | written).items()}


def _shapes(settings: Mapping[str, Any], which: str, where: str) -> dict[str, tuple[int, ...]]:
    features = settings.get(which) or {}
    try:
        shapes = {str(name): tuple(feature["shape"]) for name, feature in features.items()}
    except (KeyError, TypeError, AttributeError) as error:
        raise HandrailError(f"{where}: expected {which} of LeRobot, got {features!r:.80}") from error
    if not all(is_count(size) for shape in shapes.values() for size in shape):
        raise HandrailError(f"{where}: expected {which} with whole numbers as shapes, got {features!r:.80}")
    return shapes


def _places(robots: Iterable[str], tasks: Iterable[str], mode: str) -> Iterator[Place]:
    for robot in robots:
        joints = len(load_description(robot).joints)
        for task in tasks:
            action = len(action_of(mode, robot, task).names) if mode else joints + 1
            for movers in range(MOST_MOVING + 1 if TASKS.find(task).movers else 1):
                names = build_task(SessionConfig(task=task, moving_obstacles=movers)).state_names
                state = 2 * joints + 8
                yield Place(robot, task, movers, {STATE: state, ENVIRONMENT: len(names), ACTION: action})
                if mode:
                    yield Place(robot, task, movers, {STATE: state + len(names), ACTION: action}, joined=True)


def action_of(mode: str, robot: str, task: str) -> "ModeAction":
    """Return what the numbers of an action of a teleop mode are, as `lerobot-record` records them."""
    from handrail.collect.lerobot.mode_action import ModeAction

    model = load_model(robot)
    return ModeAction(build_mode(SessionConfig(task=task, mode=mode), model), Channels.of(model.description))


def _words(place: Place) -> str:
    moving = f" with {place.movers} moving" if place.movers else ""
    return f"{place.robot}, {place.task}{moving}: {_sizes_in_words(place.sizes)}"


def _sizes_in_words(sizes: Mapping[str, int]) -> str:
    return ", ".join(f"{name.removeprefix('observation.')} {size}" for name, size in sizes.items())
