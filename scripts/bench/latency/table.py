"""What was measured as a table, and as part of a page."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from handrail.datasets.presentation.markdown import markdown_table, write_part
from handrail.datasets.presentation.table import Table
from handrail.scripts.bench.command_line import command_line
from handrail.scripts.bench.latency.config import LatencyConfig

_LATENCIES = {
    "key to command": "key to commanded velocity",
    "key to page": "key to motion on the page",
    "round trip": "page to server and back",
    "release to brake": "release to commanded braking",
    "release to rest": "release to commanded rest",
}
_RATES = {
    "driver_frames_hz": "driver: frames a second",
    "driver_pictures_hz": "driver: pictures a second and camera",
    "spectator_frames_hz": "spectator: frames a second",
    "spectator_pictures_hz": "spectator: pictures a second and camera",
}


def latency_table(results: Mapping[str, Any]) -> Table:
    """Return everything measured, a column for each case."""
    cases, machine = results["cases"], results["machine"]
    rows = [[words, *(_percentiles(case["latencies_ms"].get(name)) for case in cases.values())]
            for name, words in _LATENCIES.items()]  # fmt: skip
    rows.append(["jitter of the loop, p99", *(f"{case['jitter_ms']['p99']:.1f}" for case in cases.values())])
    rows.append(["late periods", *(f"{each['late_periods']} of {each['frames']}" for each in cases.values())])
    rows += [[words, *(f"{case[name]:.1f}" for case in cases.values())] for name, words in _RATES.items()]
    rows.append(["share of a processor", *(_shares(case["processor_shares"]) for case in cases.values())])
    caption = (
        f"{machine['cores']} cores, load {machine['load_before']:.1f} before, {machine['load_after']:.1f} "
        f"after; {results['seconds']} s each, control at 20 Hz; times in ms as p50 / p95 / p99."
    )
    return Table(("", *cases), rows, "Latency of the cockpit", caption)


def write_page(results: Mapping[str, Any], config: LatencyConfig) -> None:
    """Put the table between its marks of the page, made if need be; other text stays."""
    table = latency_table(results)
    body = f"`{command_line('latency', config)}` wrote this. {table.caption}\n\n{markdown_table(table)}"
    write_part(Path(config.page).expanduser(), "The cockpit", "latency", body)


def _percentiles(spread: Mapping[str, float] | None) -> str:
    return f"{spread['p50']:.0f} / {spread['p95']:.0f} / {spread['p99']:.0f}" if spread else "–"


def _shares(shares: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {100 * share:.0f} %" for name, share in shares.items() if share >= 0.005)
