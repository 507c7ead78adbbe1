"""The masked MPC as a step of LeRobot's processors: a part of the motion becomes the whole robot's action.

```
 teleoperator ─ action ─┐                                     ┌─▶ robot.send_action, dataset
                        ├─▶ intent ─▶ masked MPC ─▶ limits ─▶ action in the robot's names and units
 robot ─ observation ───┘   (state: odometry, targets)
```
"""

import logging
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from lerobot.configs import FeatureType, PipelineFeatureType, PolicyFeature
from lerobot.lerobot_types import RobotAction, TransitionKey
from lerobot.processor import ProcessorStepRegistry, RobotActionProcessorStep, RobotProcessorPipeline
from lerobot.processor.converters import robot_action_observation_to_transition, transition_to_robot_action
from msgspec import Meta

from handrail.collect.clock import time_with_sleep
from handrail.collect.processor.partial_intent import PartialIntent
from handrail.collect.processor.units import robot_units
from handrail.collect.processor.whole_body import WholeBody
from handrail.controllers.errors import HandrailError, restated
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Diagnostics
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import DEAD_MAN_TIME, LONG_AGO
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.objectives.regularisation import narrow_joint_centring
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.parts import ZERO, Placement, Vector
from handrail.controllers.robot.shape import Obstacle, Shape, ShapeKind
from handrail.controllers.typed import Number, Positive, Text, check, check_names, check_settings, decoded
from handrail.datasets.storage.strict_json import load_json

NAME = "handrail_masked_mpc"
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _ObstacleTable:
    name: Text
    kind: ShapeKind
    size: tuple[Positive, ...]
    position: Vector
    rpy: Vector = ZERO
    work_surface: bool = False


def parsed_obstacles(tables: Any) -> tuple[Obstacle, ...]:
    """Return obstacles from their tables; the controller checks that no two have the same name."""
    listed = check(tables, list[Any], "obstacles")
    return tuple(_placed(decoded(table, _ObstacleTable, "obstacle")) for table in listed)


def _placed(table: _ObstacleTable) -> Obstacle:
    place, shape = Placement.of(table.position, table.rpy), Shape(table.kind, np.array(table.size))
    return Obstacle(table.name, shape, place.translation, place.rotation, work_surface=table.work_surface)


@ProcessorStepRegistry.register(NAME)
@dataclass
class MaskedMpcStep(RobotActionProcessorStep):
    """Completes a teleoperator's action to that of the whole robot; saved and loaded with its settings.

    What it sends keeps the limits of the description and distances to the floor, to the robot itself and to
    the obstacles. Where input is stale, malformed, not finite or from the future, it brakes, and counts.
    """

    robot: Annotated[str, Meta()] = "ridgeback_ur10"
    """Its name, or its description (.toml)."""
    units: str | dict[str, Any] = "plain"
    """Its names and units: plain, those of a robot of LeRobot's, or a table (docs/processor.md)."""
    fps: Positive = 30.0
    """How often the step is asked [Hz]."""
    inputs: Annotated[dict[str, tuple[str, Number]], Meta()] = field(default_factory=dict)
    """Other names of the teleoperator, each a channel and how much of it: `{"delta_x": ["ee.vx", 0.2]}`."""
    tool_frame: Literal["world", "tool"] = "world"
    """Frame in which the hand's twist is meant."""
    base_frame: Literal["base", "world"] = "base"
    """The same of the base's."""
    gripper: Literal["share", "actions"] = "share"
    """The meaning of its entries: share (0 open, 1 closed) or actions (LeRobot's 0 close, 1 stay, 2 open)."""
    obstacles: list[dict[str, Any]] = field(default_factory=list)
    """The obstacles, as tables of name, kind, size, position, rpy and work_surface."""
    start: Annotated[list[Number], Meta(min_length=3, max_length=3)] = field(
        default_factory=lambda: [0.0, 0.0, 0.0]
    )
    """Where the base is at the beginning: x, y, heading [m, rad]."""
    settings: Annotated[dict[str, Any], Meta()] = field(default_factory=dict)
    """Values of `MpcSettings` that differ from its defaults."""
    timeout: Positive = DEAD_MAN_TIME
    """Age from which an observation is stale [s]."""
    clock: Callable[[], float] = field(default=time_with_sleep, repr=False)
    """[s]; not saved."""
    counts: Counter[str] = field(default_factory=Counter, init=False, repr=False)
    """How often it braked, and why; `late`: updates that came later than the masked MPC certifies."""
    diagnostics: Diagnostics | None = field(default=None, init=False, repr=False)
    """How the controller fared in the last update."""

    def __post_init__(self) -> None:
        """Build the controller."""
        check_settings(self, NAME)
        model = load_model(self.robot)
        model.description.limits.check_inside(f"{NAME} start", model.description.base.joints, self.start)
        channels, units = Channels.of(model.description), robot_units(self.units, model.description)
        self._around, self._action_names = parsed_obstacles(self.obstacles), units.action_names
        frames = Frames(self.base_frame, self.tool_frame)
        self._intent = PartialIntent(channels, units, self.inputs, frames, self.gripper == "actions")
        self._body = WholeBody(model, units, 1.0 / self.fps, self.timeout)
        usual = asdict(MpcSettings.of(model.description.world.scale))
        settings = decoded(usual | self.settings, MpcSettings, f"{NAME} settings")
        settings.check_period(1.0 / self.fps, f"fps of {NAME}")
        self._mpc = MaskedMpc(model, settings, narrow_joint_centring(channels, model.description.limits))
        self.reset()

    def reset(self) -> None:
        """Forget the past; the base is at `start` with the next observation, as fast as that says."""
        self._body.reset(self.start, rests=False)
        self._mpc.reset(self._around)
        self._braking, self._before, self._closed = "", math.inf, (math.nan,)

    def action(self, action: RobotAction) -> RobotAction:
        """Return the whole robot's action."""
        now = float(self.clock())
        self._note_lateness(now)
        state = self._body.observe(self.transition.get(TransitionKey.OBSERVATION), now)
        closed = np.where(np.isnan(self._closed), 1.0 - self._body.openings, self._closed)
        intent = self._intent.read(action, self._body.targets, closed, now)
        if self._body.trouble:
            intent = replace(intent, time=LONG_AGO)
        command = self._mpc.update(state, intent)
        self.diagnostics, self._closed = command.diagnostics, command.grippers
        self._note_brake(command.diagnostics)
        return self._body.send(np.append(command.velocity(1.0 / self.fps), command.grippers))

    def get_config(self) -> dict[str, Any]:
        """Return the settings."""
        return {name: getattr(self, name) for name in _saved()}

    def transform_features(
        self, features: dict[PipelineFeatureType, dict[str, PolicyFeature]]
    ) -> dict[PipelineFeatureType, dict[str, PolicyFeature]]:
        """Return the features with the robot's own action."""
        own = PolicyFeature(type=FeatureType.ACTION, shape=(1,))
        return {**features, PipelineFeatureType.ACTION: dict.fromkeys(self._action_names, own)}

    def _note_brake(self, diagnostics: Diagnostics) -> None:
        """Count a brake, and say so when one begins."""
        why = (self._body.trouble or str(diagnostics.status)) if diagnostics.status.brakes else ""
        if why:
            self.counts[why] += 1
            if why != self._braking:
                _log.warning("handrail: braking: %s", why)
        self._braking = why

    def _note_lateness(self, now: float) -> None:
        """Count an update that comes too late, and say so the first time."""
        if now - self._before > self._mpc.settings.dt:
            if not self.counts["late"]:
                _log.warning("handrail: the loop is late: %.2f s between two updates", now - self._before)
            self.counts["late"] += 1
        self._before = now


def _saved() -> tuple[str, ...]:
    """Return the names of the settings that are saved."""
    return tuple(each.name for each in fields(MaskedMpcStep) if each.init and each.name != "clock")


Pipeline = RobotProcessorPipeline[tuple[RobotAction, Any], RobotAction]


def mpc_pipeline(step: MaskedMpcStep) -> Pipeline:
    """Return the pipeline of the step alone, as `lerobot_record.record(teleop_action_processor=…)` takes."""
    return RobotProcessorPipeline(
        steps=[step],
        name=NAME,
        to_transition=robot_action_observation_to_transition,
        to_output=transition_to_robot_action,
    )


def load_pipeline(folder: str | Path, clock: Callable[[], float] = time_with_sleep) -> Pipeline:
    """Return a pipeline of the step that `save_pretrained` wrote into a folder.

    LeRobot's loader imports whatever a file names; here the file says the settings of this step alone.
    """
    file = Path(folder) / f"{NAME}.json"
    match load_json(file, "a processor that save_pretrained wrote"):
        case {"steps": [{"registry_name": str(name), "config": dict(config)}]} if name == NAME:
            check_names(config, dict.fromkeys(_saved()), f"processor {file}")
        case _:
            raise HandrailError(f"processor {file}: expected the step {NAME} alone")
    if isinstance(robot := config.get("robot"), str):
        ROBOTS.admit(robot)
    with restated(f"processor {file}", HandrailError):
        return mpc_pipeline(MaskedMpcStep(**config, clock=clock))
