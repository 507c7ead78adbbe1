"""The goal-reaching benchmark from settings to report."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from handrail.collect.world.gl import graphics_trouble
from handrail.datasets.presentation.drawing import address, png, svg
from handrail.datasets.presentation.markdown import markdown_table, write_part
from handrail.datasets.presentation.markup import film, folded, page, panels, paragraph, section
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.datasets.storage.strict_json import write_json
from handrail.scripts.bench.command_line import command_line
from handrail.scripts.bench.goal_reaching.catalogue import BASELINES, Baseline
from handrail.scripts.bench.goal_reaching.config import BenchmarkConfig
from handrail.scripts.bench.goal_reaching.figures import CAPTIONS, figures
from handrail.scripts.bench.goal_reaching.results import measures_by_goal, summarise
from handrail.scripts.bench.goal_reaching.run import available, goals, run, trace_of
from handrail.scripts.bench.goal_reaching.tables import benchmark_tables
from handrail.scripts.bench.goal_reaching.video import Example

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
    parts = [section("Tables", *benchmark_tables(results))]
    parts.append(
        section("Figures", panels([(CAPTIONS[name], "", svg(each)) for name, each in drawn.items()], "wide"))
    )
    if video is not None:
        parts.append(section("Example", film(address(video.read_bytes(), "video/mp4"))))
    settings = (folded(group, paragraph(_listed(results[group]))) for group in _CONDITIONS if results[group])
    parts.append(section("Conditions", *settings))
    what = f"{results['config']['goals']} goals, the same for every controller"
    write_whole(path, page("Goal reaching", *parts, what=what).encode())


def _listed(settings: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {value}" for name, value in settings.items())


def write_page(
    results: Mapping[str, Any], pictures: Mapping[str, bytes], path: Path, config: BenchmarkConfig
) -> None:
    """Put tables and figures into a page, between the marks of this kind of run; other text stays.

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
    parts = [f"`{command}` wrote this. {_how(results)}"]
    for table in benchmark_tables(results):
        parts += [markdown_table(table), table.caption]
    parts += [f"![{CAPTIONS.get(name, name)}]({stem}_{name}.png)" for name in pictures]
    parts += [f"Left out: {name} ({reason})." for name, reason in results["skipped"].items()]
    once = dict.fromkeys(filter(None, parts))  # a caption
    write_part(path, "Goal reaching", config.label, "\n\n".join(once))


def _how(results: Mapping[str, Any]) -> str:
    """Return how the numbers are to be read, those that depend on the machine above all."""
    machine, workers = results["machine"], results["config"]["workers"]
    return (
        "Mean ± SD (min, max) over the episodes. Update ms: the median over an episode's updates, without the"
        f" distances that baselines only report. {machine['cores']} cores; load at the end"
        f" {machine['load']:.1f}, of which {workers} by this run: times are longer where others computed too."
    )


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
