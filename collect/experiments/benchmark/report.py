"""The benchmark's report: one HTML file that carries its figures and its video."""

from collections.abc import Iterator, Mapping
from itertools import cycle
from pathlib import Path
from typing import Any

from handrail.collect.experiments.benchmark.figures import CAPTIONS
from handrail.collect.experiments.benchmark.tables import all_profiles_table, profile_tables
from handrail.datasets.presentation.drawing import COLOURS, address, svg
from handrail.datasets.presentation.markup import (
    card,
    cards,
    film,
    folded,
    page,
    panels,
    paragraph,
    section,
)
from handrail.datasets.presentation.wording import percent, percent_span
from handrail.datasets.storage.atomic import write_whole

_CONDITIONS = ("config", "mpc_settings", "mpc_paper_settings", "physics", "machine", "versions", "skipped")


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
    profiles = list(results["profiles"])
    parts = [cards(_cards(results))]
    parts += [section(f"Profile {profile}", *profile_tables(results, profile)) for profile in profiles]
    parts += [section("All profiles", all_profiles_table(results))] if len(profiles) > 1 else []
    parts.append(
        section("Figures", panels([(CAPTIONS[name], "", svg(each)) for name, each in drawn.items()], "wide"))
    )
    if video is not None:
        parts.append(section("Example", film(address(video.read_bytes(), "video/mp4"))))
    settings = (folded(group, paragraph(_listed(results[group]))) for group in _CONDITIONS if results[group])
    parts.append(section("Conditions", *settings))
    what = f"{results['config']['goals']} goals, the same for every controller"
    write_whole(path, page("Goal reaching", *parts, what=what).encode())


def _cards(results: Mapping[str, Any]) -> Iterator[str]:
    """Yield what can be seen at once, a card a controller."""
    for colour, (name, summary) in zip(cycle(COLOURS), results["controllers"].items(), strict=False):
        share = summary["success"]
        lines = (
            f"of {summary['episodes']} goals, {percent_span(share['interval'])} (95 %)",
            f"in contact in {summary['episodes_with_contact']} episodes",
        )
        yield card(results["titles"][name], colour, percent(share["mean"]), lines)


def _listed(settings: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {value}" for name, value in settings.items())
