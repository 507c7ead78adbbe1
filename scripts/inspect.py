"""`handrail-inspect`: print a dataset's episodes as a table."""

from handrail.collect.commands.config import InspectConfig
from handrail.scripts import cli


@cli.command("handrail-inspect", InspectConfig)
def main(config: InspectConfig) -> int:
    """Run the command."""
    from handrail.collect.commands.tables import quality_table, summary_table, worst_table
    from handrail.datasets.presentation.terminal import Terminal
    from handrail.datasets.quality.worst import deletion, ranking_metric, worst_episodes
    from handrail.datasets.reading.check import check_report
    from handrail.datasets.reading.reader import read_info
    from handrail.datasets.recording.repair import repair

    console = Terminal()
    faults: list[str] = []
    if config.repair:
        report = repair(config.dataset.folder)
        faults += report.damage
        console.print(str(report))
    if config.check:
        found = check_report(config.dataset.folder)
        faults += found
        said = found or ["checked: everything is as it was saved"]
        console.print(*said, sep="\n")
    if faults:
        return cli.FAILED
    if config.worst:
        metric = ranking_metric(config.worst)
        worst = worst_episodes(config.dataset.folder, metric, config.count)
        console.print(worst_table(config.dataset.folder, metric, worst))
        leave_out = deletion(read_info(config.dataset.folder), [each.episode.number for each in worst])
        console.print(f"Without them: {leave_out}")
        return 0
    console.print(summary_table(config.dataset.folder))
    if config.quality:
        console.print(quality_table(config.dataset.folder))
    return 0


if __name__ == "__main__":
    main()
