"""The goal-reaching benchmark from settings to report."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from handrail.collect.experiments.benchmark.catalogue import Baseline
from handrail.collect.experiments.benchmark.config import BenchmarkConfig
from handrail.collect.experiments.benchmark.episode import Conditions
from handrail.collect.experiments.benchmark.figures import figures
from handrail.collect.experiments.benchmark.metrics import Trace
from handrail.collect.experiments.benchmark.page import write_page
from handrail.collect.experiments.benchmark.report import write_report
from handrail.collect.experiments.benchmark.results import save_json, summarise
from handrail.collect.experiments.benchmark.run import Episode, available, goals, run, trace_of
from handrail.collect.experiments.benchmark.video import film, strip
from handrail.collect.simulation.gl import graphics_trouble
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import load_model
from handrail.datasets.presentation.drawing import png


def benchmark(config: BenchmarkConfig, baselines: Mapping[str, Baseline], console: Console) -> dict[str, Any]:
    """Run the benchmark, write what is asked for, return the results.

    Args:
        config: what to run and write.
        baselines: all that there are, by name.
        console: for the progress bar and what was left out.

    Raises:
        HandrailError: a setting is wrong, a controller cannot take part, or a folder cannot be written.
    """
    config.check()
    report = _folder(config)
    present, skipped = available(baselines, config)
    for name, reason in skipped.items():
        console.print(f"without {name}: {reason}", highlight=False)
    episodes = _run(config, present, console)
    results = summarise([episode.row for episode in episodes], config, present, skipped)
    if config.json:
        save_json(results, Path(config.json).expanduser())
    drawn = figures(results, episodes, goals(config)) if report or config.page else {}
    example = _example(config, present, console)
    if report:
        save_json(results, report / "benchmark.json")
        write_report(results, drawn, _video(example, report), report / "benchmark.html")
    if config.page:
        pictures = {name: png(figure) for name, figure in drawn.items()}
        pictures |= {"example": strip(load_model(), *example)} if example else {}
        write_page(results, pictures, Path(config.page).expanduser(), config)
    return results


def _run(config: BenchmarkConfig, present: tuple[Baseline, ...], console: Console) -> list[Episode]:
    total = config.goals * len(config.profile_names) * len(present)
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    episodes: list[Episode] = []
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("episodes", total=total)
        for some in run(config, present):
            episodes += some
            progress.advance(task, len(some))
    return sorted(episodes, key=lambda episode: episode.row["goal"])


def _folder(config: BenchmarkConfig) -> Path | None:
    if not config.report:
        return None
    folder = Path(config.report).expanduser()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise HandrailError(f"--report {config.report}: cannot be made: {error.strerror}") from error
    return folder


def _example(
    config: BenchmarkConfig, present: tuple[Baseline, ...], console: Console
) -> tuple[Conditions, list[tuple[Baseline, Trace]]] | None:
    """Return what the first two controllers do on the first goal; None without OpenGL, which is said."""
    if not (config.report or config.page):
        return None
    trouble = graphics_trouble() if config.video else "not asked for"
    if trouble:
        console.print(f"without an example to look at: {trouble}", highlight=False)
        return None
    runs = [(who, trace_of(config, who, 0)) for who in present[:2]]
    return runs[0][1][0], [(who, trace) for who, (_, trace) in runs]


def _video(example: tuple[Conditions, list[tuple[Baseline, Trace]]] | None, folder: Path) -> Path | None:
    """Film the example, if there is one."""
    if example is None:
        return None
    film(load_model(), *example, folder / "benchmark.mp4")
    return folder / "benchmark.mp4"
