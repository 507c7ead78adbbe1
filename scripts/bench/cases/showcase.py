"""The showcase: the paper's three cases with one controller; a video, a figure and the figures as JSON."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from msgspec import Meta

from handrail.collect.operators.operator import View
from handrail.collect.session.film import SIZE, Filmer
from handrail.collect.session.session import Observer, Session
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.gl import graphics_trouble
from handrail.collect.world.task import FixedTask, Start, Verdict
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError, check_known
from handrail.controllers.interface.channel_matrix import channel_matrix
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.prediction import Extrapolated
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.objectives.hold import end_effector_hold, hold_parameters
from handrail.controllers.objectives.objective import switchable, switched
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.model import Pose, RobotModel, load_model
from handrail.controllers.typed import check_settings
from handrail.datasets.presentation.drawing import png
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.recording.frames import Frame
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.datasets.storage.strict_json import write_json
from handrail.scripts.bench.cases.cases import PaperCase, cases
from handrail.scripts.bench.cases.figure import case_figure
from handrail.scripts.bench.cases.trace import CaseTrace

CASES = ("a", "b", "c", "d")


@dataclass(frozen=True)
class ShowcaseConfig:
    """Run a case: a: steer the hand; b: steer the base; c: base on a circle, hand held; d: both held."""

    case: tyro.conf.Positional[str]
    """Which: a, b, c or d."""
    output: str = "outputs/showcase"
    """Folder for the video, the figure and the JSON."""
    seconds: Annotated[float, Meta(ge=0, le=120)] = 0.0
    """How long [s]; the case's own length when 0."""
    video: bool = True
    """Whether to make the video (needs OpenGL)."""

    @property
    def folder(self) -> Path:
        """The folder to write to."""
        return Path(self.output).expanduser()

    def check(self) -> None:
        """Check what can be checked without loading anything heavy."""
        check_known("case", (self.case,), CASES)
        check_settings(self, "--")
        if self.folder.exists() and not self.folder.is_dir():
            raise HandrailError(f"--output {self.output}: expected a folder, found a file")


FPS = 20
_WINDOW, _FADE = 0.2, 1.0  # of the intent's prediction [s]
_HOLD = 20.0  # weight of the hand's position in case C [1/m²]


def showcase(config: ShowcaseConfig) -> dict[str, Any]:
    """Run a case and write `<case>.mp4`, `<case>.png` and `<case>.json`; return what the JSON says.

    Without OpenGL there is no video, and `video` says why.
    """
    case = cases()[config.case]
    case = replace(case, seconds=config.seconds or case.seconds)
    with explained(f"--output {config.output}: cannot be made"):
        config.folder.mkdir(parents=True, exist_ok=True)
    file = config.folder / f"{case.name}.mp4"
    mpc = build_controller(load_model(case.robot))
    trouble = graphics_trouble() if config.video else "not asked for"
    if trouble:
        trace = run_case(case, mpc)
    else:
        with Filmer(file, FPS, case.title, partial(_words, case)) as filmer:
            trace = run_case(case, mpc, (filmer,), render_mode="rgb_array", render_size=SIZE)
    result = trace.summary() | {"video": f"none: {trouble}" if trouble else file.name}
    write_whole(file.with_suffix(".png"), png(case_figure(trace, mpc.model, mpc.settings.margin)))
    write_json(file.with_suffix(".json"), result)
    return result


def _words(case: PaperCase, frame: Frame) -> str:
    """Say what is steered and how near things are."""
    diagnostics = frame.diagnostics
    return (
        f"{frame.intent.time:5.1f} s     commanded: {', '.join(case.channels)}     "
        f"nearest: {diagnostics.smallest_distance:.3f} m     update: {1e3 * diagnostics.solve_time:.1f} ms"
    )


def build_controller(model: RobotModel) -> MaskedMpc:
    """Return the one controller of all cases: the masked MPC with a hold that can be switched on."""
    channels = Channels.of(model.description)
    holds = (end_effector_hold(channels, position=_HOLD, hand=hand) for hand in range(len(channels.hands)))
    settings = MpcSettings(posture=0.0)  # no posture to return to
    return MaskedMpc(
        model, settings, objectives=tuple(map(switchable, holds)), predict=Extrapolated(_WINDOW, _FADE)
    )


def parameters(case: PaperCase) -> Mapping[str, FloatArray]:
    """Return the parameters of the objectives in a case, by objective."""
    points = case.held or (np.zeros(3),)
    names = (hand.named("hold") for hand in load_model(case.robot).description.hands)
    poses = (Pose(np.array(point), np.eye(3)) for point in points)
    return {
        name: switched(hold_parameters(pose), bool(case.held))
        for name, pose in zip(names, poses, strict=True)
    }


def run_case(
    case: PaperCase, mpc: MaskedMpc, observers: tuple[Observer, ...] = (), **render: Any
) -> CaseTrace:
    """Run a case and return what happened.

    Args:
        case: which.
        mpc: the controller.
        observers: who else sees it.
        render: mode and size of the environment's pictures.
    """
    begin, end = Start(case.scene, case.q), case.seconds - 0.5 / FPS
    task = FixedTask(begin, lambda state: Verdict(state.time > end), case.seconds + 1.0)
    env, observer = HandrailEnv(task, mpc.model, fps=FPS, **render), _Observer(case, mpc)
    try:
        operator = _Operator(case, mpc.channels)
        outcome = Session(env, mpc, operator, (observer, *observers)).run(seed=0)
    finally:
        env.close()
    states, collision = observer.states, CollisionModel(mpc.model, case.scene.obstacles())
    q = np.array([state.q for state in states])
    tools = [hand.named("tool") for hand in mpc.model.description.hands]
    return CaseTrace(
        case=case,
        times=np.array([state.time for state in states]),
        q=q,
        asked=np.array([case.command(state.time, case.seconds) for state in states]),
        realised=np.array([_realised(case, mpc, state) for state in states]),
        hands=np.array([[mpc.model.pose(row, tool).position for tool in tools] for row in q]),
        pairs=collision.pairs,
        own_margin=collision.largest_margin < mpc.settings.margin,
        distances=collision.values(q),
        solve_times=observer.solve_times,
        outcome=outcome,
    )


def _realised(case: PaperCase, mpc: MaskedMpc, state: State) -> FloatArray:
    """Return the measured velocity on the commanded channels."""
    velocity = channel_matrix(mpc.model, mpc.channels, state.q) @ state.v
    if case.frames.base == "world":
        velocity[:3] = state.v[:3]
    return velocity[mpc.channels.mask(*case.channels)]


class _Operator:
    """Commands what the case says."""

    def __init__(self, case: PaperCase, channels: Channels) -> None:
        self._case, self._mask = case, channels.mask(*case.channels)

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin."""

    def act(self, view: View) -> Intent:
        time, case = view.state.time, self._case
        values = np.zeros(len(self._mask))
        values[self._mask] = case.command(time, case.seconds)
        return Intent(values, self._mask, mode=f"case {case.name}", time=time, frames=case.frames)


class _Observer:
    """Gives the objectives the case's parameters, once the controller is reset; notes what happens."""

    def __init__(self, case: PaperCase, mpc: MaskedMpc) -> None:
        self._case, self._mpc = case, mpc
        self.states: list[State] = []
        self.solve_times: list[float] = []

    def begin(self, env: HandrailEnv, seed: int) -> None:
        self._plant = env.plant
        for objective, values in parameters(self._case).items():
            self._mpc.set_parameters(objective, values)

    def see(self, frame: Frame) -> None:
        self.states.append(self._plant.state())
        self.solve_times.append(frame.diagnostics.solve_time)


def main(config: ShowcaseConfig) -> int:
    """Run a case and print the results."""
    console = Terminal()
    console.print(f"Running case {config.case.upper()} …")
    result = showcase(config)
    console.print(*_lines(result), sep="\n")
    if result["video"].startswith("none: ") and config.video:
        console.print(f"Without a video: {result['video'].removeprefix('none: ')}")
    console.print(f"Written: {config.folder}/{config.case}.*")
    return 0


def _lines(result: dict[str, Any]) -> Iterator[str]:
    tracking, nearest, solve = result["tracking"], result["smallest_distance"], result["solve_time_ms"]
    yield result["title"]
    yield (
        f"tracking error   {tracking['share']:.2%} of {tracking['cruising_speed']:.2f} m/s in the mean, "
        f"{1e3 * tracking['max']:.1f} mm/s at most"
    )
    yield (
        f"nearest          {nearest['value']:.3f} m ({' – '.join(nearest['pair'])}), "
        f"contacts {result['contacts']}, brakes {result['brakes']}"
    )
    yield f"update           {solve['median']:.2f} ms median, {solve['p99']:.2f} ms p99"
    if "hold" in result:
        mean, most = (1e3 * result["hold"][name] for name in ("mean", "max"))
        yield f"hands held       {mean:.1f} mm off in the mean, {most:.1f} mm at most"
