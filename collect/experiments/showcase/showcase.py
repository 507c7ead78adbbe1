"""The showcase: the paper's three cases with one controller; a video, a figure and the figures as JSON."""

import contextlib
import json
from dataclasses import replace
from functools import partial
from typing import Any

from handrail.collect.envs.env import HandrailEnv
from handrail.collect.experiments.showcase.cases import Case, cases
from handrail.collect.experiments.showcase.config import ShowcaseConfig
from handrail.collect.experiments.showcase.figure import save_figure
from handrail.collect.experiments.showcase.metrics import summary
from handrail.collect.experiments.showcase.run import FPS, ShowcaseTask, Trace, build_controller, run_case
from handrail.collect.session.film import SIZE, Filmer
from handrail.collect.simulation.gl import graphics_trouble
from handrail.controllers.errors import HandrailError
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.model import load_model
from handrail.datasets.recording.frames import Frame
from handrail.datasets.storage.atomic import write_whole


def showcase(config: ShowcaseConfig) -> dict[str, Any]:
    """Run a case and write `<case>.mp4`, `<case>.png` and `<case>.json`; return what the JSON says.

    Without OpenGL there is no video, and `video` says why.

    Raises:
        HandrailError: a setting is wrong, or the folder cannot be written.
    """
    config.check()
    case = cases()[config.case]
    case = replace(case, seconds=config.seconds or case.seconds)
    try:
        config.folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise HandrailError(f"--output {config.output}: cannot be made: {error.strerror}") from error
    mpc = build_controller(load_model())
    trouble = graphics_trouble() if config.video else "not asked for"
    trace = _run(case, mpc, config, film=not trouble)
    save_figure(trace, mpc.model, mpc.settings.margin, config.folder / f"{case.name}.png")
    result = summary(trace) | {"video": f"{case.name}.mp4" if not trouble else f"none: {trouble}"}
    write_whole(config.folder / f"{case.name}.json", (json.dumps(result, indent=2) + "\n").encode())
    return result


def _run(case: Case, mpc: MaskedMpc, config: ShowcaseConfig, film: bool) -> Trace:
    with contextlib.ExitStack() as stack:
        mode = "rgb_array" if film else None
        env = HandrailEnv(ShowcaseTask(case), fps=FPS, render_mode=mode, render_size=SIZE)
        stack.callback(env.close)
        path = config.folder / f"{case.name}.mp4"
        filmers = (stack.enter_context(Filmer(path, FPS, case.title, partial(_words, case))),) if film else ()
        return run_case(case, env, mpc, filmers)


def _words(case: Case, frame: Frame) -> str:
    """Say what is steered and how near things are."""
    diagnostics = frame.diagnostics
    return (
        f"{frame.intent.time:5.1f} s     commanded: {', '.join(case.channels)}     "
        f"nearest: {diagnostics.smallest_distance:.3f} m     update: {1e3 * diagnostics.solve_time:.1f} ms"
    )
