"""Does one job of a study; whatever is killed goes on where it was."""

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.reading.reader import read_episodes, read_info
from handrail.datasets.storage.atomic import remove
from handrail.policies.imitation.interface.checkpoint import last_checkpoint
from handrail.policies.study.design.design import StudyDesign
from handrail.policies.study.design.jobs import CONDITIONS, Cell, Job, Layout, StudyPolicy
from handrail.policies.study.design.progress import StudyProgress, read_json, write_json
from handrail.policies.study.design.settings import evaluations, fingerprint, recording, training

_MOST_ATTEMPTS = 6  # for each success that is wanted


def do(job: Job, design: StudyDesign, root: Path) -> None:
    """Do a job of a study and write that it is done.

    Raises:
        HandrailError, OSError: it cannot be done.
    """
    layout, start = Layout(root), time.time()
    begin(job, design, layout)
    result = work(job, design, layout)
    settings, seconds = fingerprint(job, design), round(time.time() - start, 1)
    write_json(layout.done(job), {"settings": settings, "result": result, "seconds": seconds})


def begin(job: Job, design: StudyDesign, layout: Layout) -> None:
    """Remove what a job made with other settings before, then note with which it begins.

    A dataset may grow, but never mix two ways to record; rollouts of other conditions go, and those of a
    policy that is gone; a policy that learnt otherwise goes with all its rollouts.

    Raises:
        HandrailError: nobody knows with which settings something was made that is there.
    """
    settings, before = fingerprint(job, design), read_json(layout.begun(job))
    stale = [path for path in _stale(job, settings, before, layout) if path.exists()]
    if stale and "recording" not in before:
        raise HandrailError(
            f"{job.name}: expected a note of this version on how {stale[0]} was made in "
            f"{layout.begun(job)}, found none; remove what is there, or choose another --output"
        )
    for path in stale:
        print(f"removed, made with other settings: {path}")
        remove(path)
    write_json(layout.begun(job), settings)


def _stale(job: Job, now: Mapping[str, Any], before: Mapping[str, Any], layout: Layout) -> list[Path]:
    """Return where something would be that does not go with the settings of now."""
    if job.cell:
        return [layout.dataset(job.cell)] if now["recording"] != before.get("recording") else []
    if job.policy is None:
        return []
    policy, driven = job.policy, before.get("evaluations", {})
    if any(now[part] != before.get(part) for part in ("recording", "wanted", "training")):
        return [layout.policy(policy), *(layout.evaluation(policy, what) for what in CONDITIONS)]
    gone = last_checkpoint(layout.policy(policy)) is None
    others = [what for what in CONDITIONS if gone or now["evaluations"].get(what) != driven.get(what)]
    return [layout.evaluation(policy, what) for what in others]


def work(job: Job, design: StudyDesign, layout: Layout) -> dict[str, Any]:
    """Do a job and return what is to be noted of it: how much there is of a dataset.

    Raises:
        HandrailError: it cannot be done.
    """
    if job.cell:
        return _collect(job.cell, design, layout)
    if job.policy:
        _train_and_evaluate(job, job.policy, design, layout)
    else:
        _compare(job.task, design, layout)
    return {}


def _collect(cell: Cell, design: StudyDesign, layout: Layout) -> dict[str, Any]:
    """Record in turns of a few episodes, each by another person, until there is enough."""
    from handrail.collect.commands.record import record

    wanted, root = design.tasks[cell.task], layout.dataset(cell)
    found = _collected(root) if root.exists() else {"episodes": 0, "successes": 0, "minutes": 0.0}
    while found["successes"] < wanted.episodes or found["minutes"] < wanted.minutes:
        code = record(recording(cell, design, root, found["episodes"]))
        if code:
            raise HandrailError(f"collecting {cell.name}: recording ended with exit code {code}")
        found = _collected(root)
        if found["episodes"] >= _MOST_ATTEMPTS * wanted.episodes and found["successes"] < wanted.episodes:
            raise HandrailError(
                f"collecting {cell.name}: expected {wanted.episodes} successes, "
                f"got {found['successes']} in {found['episodes']} attempts"
            )
    return found


def _collected(root: Any) -> dict[str, Any]:
    episodes = read_episodes(root)
    return {
        "episodes": len(episodes),
        "successes": sum(bool(episode["success"]) for episode in episodes),
        "minutes": sum(episode["length"] for episode in episodes) / read_info(root).fps / 60.0,
    }


def _train_and_evaluate(job: Job, policy: StudyPolicy, design: StudyDesign, layout: Layout) -> None:
    """Train a policy and let it drive, under every condition into a file of its own."""
    from handrail.policies.imitation.evaluation.evaluation import evaluate
    from handrail.policies.imitation.training.training import train

    folder = train(training(policy, design, layout.dataset(policy.cell), layout.policy(policy)))
    for what, config in evaluations(job, design, str(folder)).items():
        file = layout.evaluation(policy, what)
        file.parent.mkdir(parents=True, exist_ok=True)
        evaluate(replace(config, json=str(file)))


def _compare(task: str, design: StudyDesign, layout: Layout) -> None:
    """Write the report of a task: its datasets and what the policies did."""
    from handrail.datasets.comparison.compare import compare
    from handrail.datasets.comparison.report.report import write_report

    cells = [Cell(task, mode) for mode in design.modes]
    progress = StudyProgress(design, layout)
    files = [path for cell in cells for path in progress.evaluations(cell, "nominal")]
    config = CompareConfig(
        datasets=tuple(str(layout.dataset(cell)) for cell in cells),
        labels=design.modes,
        baseline=design.baseline,
        evaluations=tuple(map(str, files)),
        output=str(layout.comparison(task)),
    )
    write_report(compare(config))
