"""The benchmark's part of a Markdown page: tables and figures between two marks; what a repository keeps."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from handrail.collect.experiments.benchmark.config import BenchmarkConfig
from handrail.collect.experiments.benchmark.figures import CAPTIONS
from handrail.collect.experiments.benchmark.results import save_json
from handrail.collect.experiments.benchmark.tables import benchmark_tables
from handrail.datasets.presentation.markdown import markdown_table, write_part
from handrail.datasets.storage.atomic import write_whole


def write_page(
    results: Mapping[str, Any], pictures: Mapping[str, bytes], page: Path, config: BenchmarkConfig
) -> None:
    """Put tables and figures into a page, between the marks of this kind of run; other text stays.

    Figures and the summaries as JSON go beside the page, named `<page>_<label>…`.

    Args:
        results: as summarised.
        pictures: PNG by name.
        page: the Markdown file, made if it is not there.
        config: what was run.
    """
    stem = f"{page.stem}_{config.label}"
    for name, data in pictures.items():
        write_whole(page.parent / f"{stem}_{name}.png", data)
    save_json({k: v for k, v in results.items() if k != "episodes"}, page.parent / f"{stem}.json")
    write_part(page, "Goal reaching", config.label, "\n\n".join(_parts(results, pictures, stem)))


def _parts(results: Mapping[str, Any], pictures: Mapping[str, bytes], stem: str) -> list[str]:
    parts = [f"`{_command(results)}` wrote this. {_how(results)}"]
    for table in benchmark_tables(results):
        parts += [markdown_table(table), table.caption]
    parts += [f"![{CAPTIONS.get(name, name)}]({stem}_{name}.png)" for name in pictures]
    parts = list(dict.fromkeys(filter(None, parts)))  # a caption once
    return parts + [f"Left out: {name} ({reason})." for name, reason in results["skipped"].items()]


def _how(results: Mapping[str, Any]) -> str:
    """Return how the numbers are to be read, those that depend on the machine above all."""
    machine, workers = results["machine"], results["config"]["workers"]
    return (
        "Mean ± SD (min, max) over the episodes. Update ms: the median over an episode's updates, without the"
        f" distances that rivals only report. {machine['cores']} cores; load at the end"
        f" {machine['load']:.1f}, of which {workers} by this run: times are longer where others computed too."
    )


def _command(results: Mapping[str, Any]) -> str:
    config = results["config"]
    flags = [f"--{name} {config[name]}" for name in ("controllers", "goals", "seed", "profile", "workers")]
    flags += [f"--{name}" for name in ("clutter", "closed_loop") if config[name]]
    flags += [f"--no_{name}" for name in ("physics", "early_stop") if not config[name]]
    return " ".join(["handrail-benchmark", *flags])
