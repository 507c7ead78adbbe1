"""What the benchmark writes for readers: an HTML file that carries everything, a part of a Markdown page."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from handrail.datasets.presentation.drawing import address, svg
from handrail.datasets.presentation.markdown import markdown_table, write_part
from handrail.datasets.presentation.markup import film, folded, page, panels, paragraph, section
from handrail.datasets.storage.atomic import write_whole
from handrail.datasets.storage.strict_json import write_json
from handrail.scripts.bench.command_line import command_line
from handrail.scripts.bench.goal_reaching.config import BenchmarkConfig
from handrail.scripts.bench.goal_reaching.figures import CAPTIONS
from handrail.scripts.bench.goal_reaching.results import measures_by_goal
from handrail.scripts.bench.goal_reaching.tables import benchmark_tables

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
