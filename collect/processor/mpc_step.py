"""The masked MPC as a step of LeRobot's processors: a part of the motion becomes the whole robot's action.

```
 teleoperator ─ action ─┐                                     ┌─▶ robot.send_action, dataset
                        ├─▶ intent ─▶ masked MPC ─▶ limits ─▶ action in the robot's names and units
 robot ─ observation ───┘   (state: odometry, targets)
```
"""

import logging
import math
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from lerobot.configs import FeatureType, PipelineFeatureType, PolicyFeature
from lerobot.lerobot_types import RobotAction, TransitionKey
from lerobot.processor import ProcessorStepRegistry, RobotActionProcessorStep, RobotProcessorPipeline
from lerobot.processor.converters import (
    robot_action_observation_to_transition,
    transition_to_robot_action,
)

from handrail.collect.processor.partial_intent import PartialIntent
from handrail.collect.processor.units import robot_units
from handrail.collect.processor.whole_body import WholeBody
from handrail.controllers.entries import Entry, check_entries, is_number, is_positive, is_text, lists
from handrail.controllers.errors import HandrailError, message_of, shown
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Diagnostics
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import DEAD_MAN_TIME, LONG_AGO
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.objectives.regularisation import narrow_joint_centring
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Obstacle, Shape
from handrail.datasets.storage.strict_json import load_json

NAME = "handrail_masked_mpc"
_CENTRED = 10.0  # weight of the middle of joints that cannot turn half around
_KEPT = (
    *("robot", "units", "fps", "inputs", "tool_frame", "base_frame", "gripper"),
    *("obstacles", "start", "settings", "timeout"),
)
_log = logging.getLogger(__name__)


_ENTRIES = {
    "name": Entry("a name", is_text),
    "kind": Entry("box, capsule, sphere or cylinder", is_text),
    "size": Entry("lengths [m]", lists(is_positive)),
    "position": Entry("three numbers [m]", lists(is_number, 3)),
    "rpy": Entry("three angles [rad]", lists(is_number, 3), needed=False),
    "work_surface": Entry("true or false", lambda value: isinstance(value, bool), needed=False),
}


def parsed_obstacles(tables: Any) -> tuple[Obstacle, ...]:
    """Return obstacles from their tables."""
    if not isinstance(tables, list):
        raise HandrailError(f"obstacles: expected a list of tables, got {shown(tables)}")
    for table in tables:
        check_entries(table, _ENTRIES, "obstacle")
    names = [table["name"] for table in tables]
    if len(set(names)) != len(names):
        raise HandrailError(f"obstacles: expected each name once, got {', '.join(names)}")
    return tuple(
        Obstacle(
            table["name"],
            Shape(table["kind"], np.array(table["size"], dtype=float)),
            np.array(table["position"], dtype=float),
            matrix_from_rpy(table.get("rpy", (0.0, 0.0, 0.0))),
            work_surface=table.get("work_surface", False),
        )
        for table in tables
    )


@ProcessorStepRegistry.register(NAME)
@dataclass
class MaskedMpcStep(RobotActionProcessorStep):
    """Completes a teleoperator's action to that of the whole robot; saved and loaded with its settings.

    What it sends keeps the limits of the description and distances to the floor, to the robot itself and to
    the obstacles. Where input is stale, malformed, not finite or from the future, it brakes, and counts.

    Attributes:
        robot: its name, or its description (.toml).
        units: its names and units: lekiwi, so_follower, plain, or a table (docs/processor.md).
        fps: how often the step is asked [Hz].
        inputs: other names that the teleoperator uses: `{"delta_x": ["ee.vx", 0.2]}`.
        tool_frame: frame in which the hand's twist is meant: world or tool.
        base_frame: the same of the base's: base or world.
        gripper: what its entry is: share (0 open, 1 closed) or actions (LeRobot's 0 close, 1 stay, 2 open).
        obstacles: what stands around, as tables of name, kind, size, position, rpy and work_surface.
        start: where the base is at the beginning: x, y, heading [m, rad].
        settings: what shall differ of `MpcSettings`.
        timeout: age from which an observation is stale [s].
        clock: [s]; not saved.
        counts: how often it braked, and why; `late`: updates that came later than the masked MPC certifies.
        diagnostics: how the controller fared in the last update.
    """

    robot: str = "ridgeback_ur10"
    units: str | dict[str, Any] = "plain"
    fps: float = 30.0
    inputs: dict[str, Any] = field(default_factory=dict)
    tool_frame: str = "world"
    base_frame: str = "base"
    gripper: str = "share"
    obstacles: list[dict[str, Any]] = field(default_factory=list)
    start: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    settings: dict[str, Any] = field(default_factory=dict)
    timeout: float = DEAD_MAN_TIME
    clock: Callable[[], float] = field(default=time.monotonic, repr=False)
    counts: Counter[str] = field(default_factory=Counter, init=False, repr=False)
    diagnostics: Diagnostics | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        """Build the controller."""
        self._check()
        model = load_model(self.robot)
        frames, channels = Frames(self.base_frame, self.tool_frame), Channels.of(model.description)
        if not frames.are_known:
            raise HandrailError(
                "tool_frame, base_frame: expected world or tool, base or world; "
                f"got {shown(self.tool_frame)}, {shown(self.base_frame)}"
            )
        units = robot_units(self.units, model.description)
        self._around = parsed_obstacles(self.obstacles)
        self._intent = PartialIntent(channels, units, self.inputs, frames, self.gripper)
        self._body = WholeBody(model, units, 1.0 / self.fps, self.timeout)
        self._action_names = units.action_names
        centring = narrow_joint_centring(channels, model.description.limits, _CENTRED)
        settings = self._mpc_settings(model.description.world.scale)
        settings.check_period(1.0 / self.fps, f"fps of {NAME}")
        self._mpc = MaskedMpc(model, settings, centring)
        self.reset()

    def reset(self) -> None:
        """Forget the past; the base is at `start` with the next observation."""
        self._body.reset(self.start)
        self._intent.reset()
        self._mpc.reset(self._around)
        self._braking, self._before = "", math.inf

    def action(self, action: RobotAction) -> RobotAction:
        """Return the whole robot's action."""
        now = float(self.clock())
        self._note_lateness(now)
        state = self._body.observe(self.transition.get(TransitionKey.OBSERVATION), now)
        intent = self._intent.read(action, self._body.targets, self._body.opening, now)
        if self._body.trouble:
            intent = replace(intent, time=LONG_AGO)
        command = self._mpc.update(state, intent)
        self.diagnostics = command.diagnostics
        self._count(command.diagnostics)
        return self._body.send(np.append(command.velocity(1.0 / self.fps), command.gripper))

    def get_config(self) -> dict[str, Any]:
        """Return the settings."""
        return {entry.name: getattr(self, entry.name) for entry in fields(self) if entry.name in _KEPT}

    def transform_features(
        self, features: dict[PipelineFeatureType, dict[str, PolicyFeature]]
    ) -> dict[PipelineFeatureType, dict[str, PolicyFeature]]:
        """Return the features with the robot's own action."""
        own = PolicyFeature(type=FeatureType.ACTION, shape=(1,))
        return {**features, PipelineFeatureType.ACTION: dict.fromkeys(self._action_names, own)}

    def _count(self, diagnostics: Diagnostics) -> None:
        """Count a brake, and say so when one begins."""
        brakes = diagnostics.status.brakes
        why = (self._body.trouble or str(diagnostics.status)) if brakes else ""
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

    def _check(self) -> None:
        numbers = {"fps": self.fps, "timeout": self.timeout}
        for name, value in numbers.items():
            if not (isinstance(value, int | float) and 0.0 < value < math.inf):
                raise HandrailError(f"{name} of {NAME}: expected a number above 0, got {shown(value)}")
        start = self.start
        fits = isinstance(start, list | tuple) and len(start) == 3
        if not (fits and all(isinstance(each, int | float) and math.isfinite(each) for each in start)):
            raise HandrailError(f"start of {NAME}: expected x, y and heading, got {shown(start)}")
        for name in ("inputs", "settings"):
            if not isinstance(getattr(self, name), Mapping):
                raise HandrailError(f"{name} of {NAME}: expected a table, got {shown(getattr(self, name))}")

    def _mpc_settings(self, scale: float) -> MpcSettings:
        usual = asdict(MpcSettings())
        for name, value in self.settings.items():
            if name not in usual or type(value) not in (int, type(usual[name])):
                raise HandrailError(
                    f"settings of {NAME}: expected numbers for some of {', '.join(usual)}; "
                    f"got {shown(name)} = {shown(value)}"
                )
        return replace(MpcSettings.of(scale), **self.settings)


Pipeline = RobotProcessorPipeline[tuple[RobotAction, Any], RobotAction]


def mpc_pipeline(step: MaskedMpcStep) -> Pipeline:
    """Return the pipeline of the step alone, as `lerobot_record.record(teleop_action_processor=…)` takes."""
    return RobotProcessorPipeline(
        steps=[step],
        name=NAME,
        to_transition=robot_action_observation_to_transition,
        to_output=transition_to_robot_action,
    )


def load_pipeline(folder: str | Path, clock: Callable[[], float] = time.monotonic) -> Pipeline:
    """Return a pipeline of the step that `save_pretrained` wrote into a folder.

    LeRobot's loader imports whatever a file names: what is not this step is refused before.
    """
    file = Path(folder) / f"{NAME}.json"
    content = load_json(file, "a processor that save_pretrained wrote")
    steps = content.get("steps") if isinstance(content, dict) else None
    step = steps[0] if isinstance(steps, list) and len(steps) == 1 else None
    if not isinstance(step, dict) or step.get("registry_name") != NAME:
        raise HandrailError(f"processor {file}: expected the step {NAME} alone")
    config = step.get("config")
    if isinstance(config, dict) and isinstance(config.get("robot"), str):
        ROBOTS.admit(config["robot"])
    try:
        return RobotProcessorPipeline.from_pretrained(
            folder,
            config_filename=file.name,
            local_files_only=True,
            overrides={NAME: {"clock": clock}},
            to_transition=robot_action_observation_to_transition,
            to_output=transition_to_robot_action,
        )
    except Exception as error:  # whatever LeRobot's loader raises; it wraps what we say
        raise HandrailError(f"processor {file}: cannot be loaded: {message_of(error)}") from error
