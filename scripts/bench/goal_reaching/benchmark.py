"""The goal-reaching benchmark from settings to page."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from handrail.collect.world.gl import graphics_trouble
from handrail.datasets.presentation.drawing import png
from handrail.datasets.presentation.markdown import write_part
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.atomic import write_whole
from handrail.datasets.storage.strict_json import write_json
from handrail.scripts.bench.goal_reaching.config import BASELINES, Baseline, BenchmarkConfig
from handrail.scripts.bench.goal_reaching.figures import example_strip, figures
from handrail.scripts.bench.goal_reaching.metrics import measures_by_goal, summarise
from handrail.scripts.bench.goal_reaching.run import available, goals, run, trace_of
from handrail.scripts.bench.goal_reaching.tables import benchmark_tables
from handrail.scripts.bench.report import command_line, report


def write_page(
    results: Mapping[str, Any], pictures: Mapping[str, bytes], path: Path, config: BenchmarkConfig
) -> None:
    """Put the figures into a page, between the marks of this kind of run; other text stays.

    Figures, and summaries and every episode's measures as JSON, go beside the page, named `<page>_<label>…`.

    Args:
        results: as summarised.
        pictures: PNG by name.
        path: of the Markdown file, made if it is not there.
        config: what was run.
    """
    stem = f"{path.stem}_{config.label}"
    for name, data in pictures.items():
        write_whole(path.parent / f"{stem}_{name}.png", data)
    write_json(path.parent / f"{stem}.json", {**results, "episodes": measures_by_goal(results)}, indent=None)
    command = command_line("goal_reaching", replace(config, json="", page=""))
    parts = [
        f"`{command}`; [every number]({stem}.json).",
        *(f"![{name}]({stem}_{name}.png)" for name in pictures),
        *(f"Left out: {name} ({reason})." for name, reason in results["skipped"].items()),
    ]
    write_part(path, "Goal reaching", config.label, "\n\n".join(parts))


def benchmark(
    config: BenchmarkConfig, baselines: Mapping[str, Baseline], console: Terminal
) -> dict[str, Any]:
    """Run the benchmark, write what is asked for, return the results.

    Args:
        config: what to run and write.
        baselines: all that there are, by name.
        console: to show how far it is, and what was left out.
    """
    present, skipped = available(baselines, config)
    for name, reason in skipped.items():
        console.print(f"without {name}: {reason}")
    episodes = run(config, present, console)
    results = summarise([episode.row for episode in episodes], config, present, skipped)
    if config.page:
        pictures = {name: png(each) for name, each in figures(results, episodes, goals(config)).items()}
        if trouble := graphics_trouble() if config.video else "not asked for":
            console.print(f"without an example to look at: {trouble}")
        else:  # the first two controllers on the first goal
            runs = [(who, *trace_of(config, who, 0)) for who in present[:2]]
            pictures["example"] = example_strip(runs[0][1], [(who.help, trace) for who, _, trace in runs])
        write_page(results, pictures, Path(config.page).expanduser(), config)
    return results


def main(config: BenchmarkConfig) -> int:
    """Run the benchmark and print its tables."""
    console = Terminal()
    results = benchmark(config, {name: BASELINES.find(name) for name in config.controller_names}, console)
    report("goal_reaching", replace(config, page=""), benchmark_tables(results), results)
    if config.page:
        console.print(f"Written: {config.page}")
    return 0
