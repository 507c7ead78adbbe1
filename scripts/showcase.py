"""`handrail-showcase`: the paper's three cases with one controller."""

from typing import Any

from handrail.collect.experiments.showcase.config import ShowcaseConfig
from handrail.scripts import cli


@cli.command("handrail-showcase", ShowcaseConfig)
def main(config: ShowcaseConfig) -> int:
    """Run the command."""
    config.check()
    from handrail.collect.experiments.showcase.showcase import showcase
    from handrail.datasets.presentation.terminal import Terminal

    console = Terminal()
    console.print(f"Running case {config.case.upper()} …")
    result = showcase(config)
    for line in _lines(result):
        console.print(line)
    if result["video"].startswith("none: ") and config.video:
        console.print(f"Without a video: {result['video'].removeprefix('none: ')}")
    console.print(f"Written: {config.folder}/{config.case}.*")
    return 0


def _lines(result: dict[str, Any]) -> list[str]:
    tracking, nearest, solve = result["tracking"], result["smallest_distance"], result["solve_time_ms"]
    lines = [
        result["title"],
        f"tracking error   {tracking['share']:.2%} of {tracking['cruising_speed']:.2f} m/s in the mean, "
        f"{1e3 * tracking['max']:.1f} mm/s at most",
        f"nearest          {nearest['value']:.3f} m ({' – '.join(nearest['pair'])}), "
        f"contacts {result['contacts']}, brakes {result['brakes']}",
        f"update           {solve['median']:.2f} ms median, {solve['p99']:.2f} ms p99",
    ]
    if "hold" in result:
        hold = result["hold"]
        mean, most = 1e3 * hold["mean"], 1e3 * hold["max"]
        lines.append(f"hand held        {mean:.1f} mm off in the mean, {most:.1f} mm at most")
    return lines


if __name__ == "__main__":
    main()
