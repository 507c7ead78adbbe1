"""The goal-reaching benchmark from settings to report."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from handrail.collect.simulation.gl import graphics_trouble
from handrail.datasets.presentation.drawing import png
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.strict_json import write_json
from handrail.scripts.bench.goal_reaching.catalogue import BASELINES, Baseline
from handrail.scripts.bench.goal_reaching.config import BenchmarkConfig
from handrail.scripts.bench.goal_reaching.figures import figures
from handrail.scripts.bench.goal_reaching.report import write_page, write_report
from handrail.scripts.bench.goal_reaching.results import summarise
from handrail.scripts.bench.goal_reaching.run import available, goals, run, trace_of
from handrail.scripts.bench.goal_reaching.tables import benchmark_tables
from handrail.scripts.bench.goal_reaching.video import Example


def benchmark(
    config: BenchmarkConfig, baselines: Mapping[str, Baseline], console: Terminal
) -> dict[str, Any]:
    """Run the benchmark, write what is asked for, return the results.

    Args:
        config: what to run and write.
        baselines: all that there are, by name.
        console: to show how far it is, and what was left out.

    Raises:
        HandrailError: a setting is wrong, a controller cannot take part, or a folder cannot be written.
    """
    config.check()
    report = Path(config.report).expanduser()
    if config.report:
        with explained(f"--report {config.report}: cannot be made"):
            report.mkdir(parents=True, exist_ok=True)
    present, skipped = available(baselines, config)
    for name, reason in skipped.items():
        console.print(f"without {name}: {reason}")
    episodes = run(config, present, console)
    results = summarise([episode.row for episode in episodes], config, present, skipped)
    if config.json:
        write_json(Path(config.json).expanduser(), results)
    if not (config.report or config.page):
        return results
    drawn, example = figures(results, episodes, goals(config)), _example(config, present, console)
    if config.report:
        write_json(report / "benchmark.json", results)
        video = report / "benchmark.mp4" if example else None
        if example and video:
            example.film(video)
        write_report(results, drawn, video, report / "benchmark.html")
    if config.page:
        pictures = {name: png(figure) for name, figure in drawn.items()}
        pictures |= {"example": example.strip()} if example else {}
        write_page(results, pictures, Path(config.page).expanduser(), config)
    return results


def _example(config: BenchmarkConfig, present: tuple[Baseline, ...], console: Terminal) -> Example | None:
    """Return what the first two controllers do on the first goal; None without OpenGL, which is said."""
    trouble = graphics_trouble() if config.video else "not asked for"
    if trouble:
        console.print(f"without an example to look at: {trouble}")
        return None
    runs = [(who, *trace_of(config, who, 0)) for who in present[:2]]
    return Example(runs[0][1], [(who.help, trace) for who, _, trace in runs])


def main(config: BenchmarkConfig) -> int:
    """Run the benchmark and print its tables."""
    console = Terminal()
    results = benchmark(config, {name: BASELINES.find(name) for name in config.controller_names}, console)
    console.print(*benchmark_tables(results), sep="\n")
    for written in (config.json, config.report and f"{config.report}/benchmark.html", config.page):
        if written:
            console.print(f"Written: {written}")
    return 0
