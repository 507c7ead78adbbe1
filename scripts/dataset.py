"""Commands that look at datasets, change them and compare them."""

from pathlib import Path

from handrail.collect.commands.config import InspectConfig, PushConfig, RenderConfig, RepairConfig
from handrail.collect.commands.tables import quality_table, summary_table, takeover_table, worst_table
from handrail.collect.execution.pool import RENDERING, begin_loading
from handrail.controllers.errors import FAILED, HandrailError
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.editing.config import EditConfig, MergeConfig, PackConfig, packing_advice
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.quality.worst import deletion, ranking_metric, worst_episodes
from handrail.datasets.reading.check import check_report, has_checksums
from handrail.datasets.reading.reader import read_info
from handrail.datasets.recording import repair as mending


def inspect(config: InspectConfig) -> int:
    """Print a dataset's episodes as a table; return the exit code."""
    console, root = Terminal(), config.dataset.folder
    if config.check:
        faults = check_report(root)
        whole = "everything is as it was saved" if has_checksums(root) else "all can be read (no checksums)"
        console.print(*(faults or [f"checked: {whole}"]), sep="\n")
        if faults:
            return FAILED
    if config.worst:
        metric = ranking_metric(config.worst)
        worst = worst_episodes(root, metric, config.count)
        console.print(worst_table(root, metric, worst))
        console.print(f"Without them: {deletion(read_info(root), [each.episode.number for each in worst])}")
        return 0
    console.print(summary_table(root))
    if taken := takeover_table(root):
        console.print(taken)
    if config.quality:
        console.print(quality_table(root))
    return 0


def edit(config: EditConfig) -> None:
    """Edit a dataset's episodes."""
    from handrail.datasets.editing.edit import edit

    Terminal().print(*map(str, edit(config)), sep="\n")


def render(config: RenderConfig) -> None:
    """Draw the pictures of a dataset's episodes."""
    if config.is_shared and not config.ray:
        begin_loading(RENDERING)  # the workers' modules, beside this process's own
    from handrail.collect.commands.render import render

    render(config)


def pack(config: PackConfig | MergeConfig) -> None:
    """Write one dataset, or several, into few large files."""
    roots, target = config.roots, config.target
    from handrail.datasets.editing.merge import merge_datasets

    Terminal().print(str(merge_datasets(roots, target, config.name, config.verify)))


def repair(config: RepairConfig) -> int:
    """Mend a dataset; return 0 only if everything that was saved is in it and whole."""
    report = mending.repair(config.dataset.folder, config.set_aside)
    Terminal().print(str(report))
    return 0 if report.complete else FAILED


def push(config: PushConfig) -> None:
    """Write a dataset's card, print what would be sent, and send it when asked."""
    from handrail.datasets.editing.push import copy, free_place, prepare, upload

    dataset, say = config.dataset, Terminal().print

    def preview(root: Path) -> bytes:
        from handrail.collect.commands import render

        try:
            return render.preview(root)
        except HandrailError as error:
            say(f"The card gets no picture: {error}")
            return b""

    if config.upload and config.to:
        free_place(config.to)
    settings = config.license, config.private, config.verify, config.to
    push = prepare(dataset.folder, dataset.repo_id, *settings, preview)
    say(str(push))
    if advice := packing_advice(dataset.folder):
        say(advice)
    if config.upload:
        (copy if config.to else upload)(push)
        say(f"sent to {config.to}" if config.to else f"sent as {push.repo_id}")
    else:
        say("nothing was sent; --upload sends it")


def compare(config: CompareConfig) -> int:
    """Compare datasets, or people, and write a report; return the exit code."""
    console = Terminal()
    if config.study:
        from handrail.datasets.comparison.people import compare_people, people_report

        report = people_report(compare_people(config))
    else:
        from handrail.datasets.comparison.compare import compare
        from handrail.datasets.comparison.page import dataset_report

        report = dataset_report(compare(config))
    files = report.write(config.folder)
    if report.headline:
        console.print(report.headline)
        console.print()
    for table in report.tables:
        console.print(table)
    for text in report.cautions:
        console.print(f"! {text}")
    console.print()
    console.print("Written: " + ", ".join(map(str, files)))
    return 0
