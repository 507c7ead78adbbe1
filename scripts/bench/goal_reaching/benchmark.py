"""The goal-reaching benchmark from settings to report."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from handrail.collect.world.gl import graphics_trouble
from handrail.datasets.presentation.drawing import address, png, svg
from handrail.datasets.presentation.markdown import write_part
from handrail.datasets.presentation.markup import film, folded, page, panels, paragraph, section
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.datasets.storage.strict_json import write_json
from handrail.scripts.bench.goal_reaching.config import BASELINES, Baseline, BenchmarkConfig
from handrail.scripts.bench.goal_reaching.figures import CAPTIONS, Example, figures
from handrail.scripts.bench.goal_reaching.metrics import measures_by_goal, summarise
from handrail.scripts.bench.goal_reaching.run import available, goals, run, trace_of
from handrail.scripts.bench.goal_reaching.tables import benchmark_tables
from handrail.scripts.bench.report import command_line, report

_CONDITIONS = (
    *("titles", "config", "mpc_settings", "mpc_paper_settings"),
    *("physics", "machine", "versions", "skipped"),
)


def write_report(
    results: Mapping[str, Any], drawn: Mapping[str, Any], video: Path | None, path: Path
) -> None:
    """Write the report.

    Args:
        results: as summarised.
        drawn: figures by name.
        video: a file to embed.
        path: of the HTML file.
    """
    shown = [(CAPTIONS[name], "", svg(each)) for name, each in drawn.items()]
    parts = [section("Tables", *benchmark_tables(results)), section("Figures", panels(shown, "wide"))]
    if video is not None:
        parts.append(section("Example", film(address(video.read_bytes(), "video/mp4"))))
    listed = {
        group: ", ".join(f"{name} {value}" for name, value in results[group].items()) for group in _CONDITIONS
    }
    settings = (folded(group, paragraph(text)) for group, text in listed.items() if text)
    parts.append(section("Conditions", *settings))
    what = f"{results['config']['goals']} goals, the same for every controller"
    write_whole(path, page("Goal reaching", *parts, what=what).encode())


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
    command = command_line("goal_reaching", replace(config, json="", report="", page=""))
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
    config.check()
    folder = Path(config.report).expanduser()
    if config.report:
        with explained(f"--report {config.report}: cannot be made"):
            folder.mkdir(parents=True, exist_ok=True)
    present, skipped = available(baselines, config)
    for name, reason in skipped.items():
        console.print(f"without {name}: {reason}")
    episodes = run(config, present, console)
    results = summarise([episode.row for episode in episodes], config, present, skipped)
    if not (config.report or config.page):
        return results
    drawn, example = figures(results, episodes, goals(config)), None
    if trouble := graphics_trouble() if config.video else "not asked for":
        console.print(f"without an example to look at: {trouble}")
    else:  # the first two controllers on the first goal
        runs = [(who, *trace_of(config, who, 0)) for who in present[:2]]
        example = Example(runs[0][1], [(who.help, trace) for who, _, trace in runs])
    if config.report:
        write_json(folder / "benchmark.json", results)
        video = folder / "benchmark.mp4" if example else None
        if example and video:
            example.film(video)
        write_report(results, drawn, video, folder / "benchmark.html")
    if config.page:
        pictures = {name: png(figure) for name, figure in drawn.items()}
        pictures |= {"example": example.strip()} if example else {}
        write_page(results, pictures, Path(config.page).expanduser(), config)
    return results


def main(config: BenchmarkConfig) -> int:
    """Run the benchmark and print its tables."""
    console = Terminal()
    results = benchmark(config, {name: BASELINES.find(name) for name in config.controller_names}, console)
    report("goal_reaching", replace(config, page=""), benchmark_tables(results), results)
    for written in (config.report and f"{config.report}/benchmark.html", config.page):
        if written:
            console.print(f"Written: {written}")
    return 0
