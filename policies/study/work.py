"""Does one job of a study, in a process of its own; whatever is killed goes on where it was."""

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

from handrail.collect.config import DatasetConfig, RecordConfig
from handrail.controllers.errors import HandrailError
from handrail.datasets.atomic import remove
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.reader import read_episodes, read_info
from handrail.policies.imitation.config import SourceConfig, TrainConfig
from handrail.policies.imitation.evaluate_config import EvaluateConfig
from handrail.policies.study.design import StudyDesign, TaskDesign
from handrail.policies.study.jobs import CONDITIONS, Cell, Job, Layout, PolicyArm
from handrail.policies.study.notes import read_json, write_json

_BATCH = 10  # episodes, until the next person has a turn
_MOST_ATTEMPTS = 6  # for each success that is wanted
_FPS = 20  # [Hz]


def fingerprint(job: Job, design: StudyDesign) -> dict[str, Any]:
    """Return all settings that a job's result depends on, as JSON has them."""
    settings: dict[str, Any] = {"job": asdict(job)}
    if job.cell:
        task = design.tasks[job.cell.task]
        settings |= {"episodes": task.episodes, "minutes": task.minutes, "persons": design.persons}
        settings |= {"time_limit": task.time_limit.get(job.cell.mode, 0.0), "seed": design.seed}
    elif job.arm:
        settings |= {"task": asdict(design.tasks[job.arm.cell.task]), "policy": design.policy}
        settings |= {"rollouts": design.rollouts, "seed": design.seed}
        if job.robust and design.robustness:
            settings["robustness"] = asdict(design.robustness)
    else:
        settings["design"] = asdict(design)
    return json.loads(json.dumps(settings))


def begin(job: Job, design: StudyDesign, layout: Layout) -> None:
    """Note with which settings a job begins; remove what it made with others before."""
    settings, path = fingerprint(job, design), layout.begun(job)
    if read_json(path) not in ({}, settings) and job.arm:
        remove(layout.policy(job.arm))
        for what in CONDITIONS:
            remove(layout.evaluation(job.arm, what))
    write_json(path, settings)


def work(job: Job, design: StudyDesign, layout: Layout) -> dict[str, Any]:
    """Do a job and return what is worth noting about it.

    Raises:
        HandrailError: it cannot be done.
    """
    if job.cell:
        return _collect(job.cell, design, layout)
    if job.arm:
        return _policy(job.arm, job.robust, design, layout)
    return _compare(job.task, design, layout)


def _collect(cell: Cell, design: StudyDesign, layout: Layout) -> dict[str, Any]:
    """Record in turns of a few episodes, each by another person, until there is enough."""
    from handrail.collect.record import record

    wanted, root = design.tasks[cell.task], layout.dataset(cell)
    found = _collected(root) if root.exists() else {"episodes": 0, "successes": 0, "minutes": 0.0}
    while not _enough(found, wanted):
        turn = found["episodes"] // _BATCH
        code = record(
            RecordConfig(
                task=cell.task,
                mode=cell.mode,
                noise=cell.noise,
                person=1 + turn % design.persons,
                time_limit=wanted.time_limit.get(cell.mode, 0.0),
                seed=design.seed,
                dataset=DatasetConfig(
                    repo_id=f"study/{cell.task}-{cell.mode}",
                    root=str(root),
                    num_episodes=_BATCH - found["episodes"] % _BATCH,
                    fps=_FPS,
                ),
                resume=root.exists(),
            )
        )
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


def _enough(found: Mapping[str, Any], wanted: TaskDesign) -> bool:
    return found["successes"] >= wanted.episodes and found["minutes"] >= wanted.minutes


def _policy(arm: PolicyArm, robust: bool, design: StudyDesign, layout: Layout) -> dict[str, Any]:
    """Train a policy and let it drive."""
    from handrail.policies.imitation.training import train

    task = design.tasks[arm.cell.task]
    timed = arm.budget == "time"
    folder = train(
        TrainConfig(
            dataset=SourceConfig(root=str(layout.dataset(arm.cell))),
            output=str(layout.policy(arm)),
            policy=design.policy,
            actions=arm.actions,
            success_only=True,
            steps=task.steps,
            batch_size=task.batch_size,
            seed=arm.seed,
            policy_options=task.policy_options,
            minutes=task.minutes if timed else 0.0,
            episodes=0 if timed else task.episodes,
            resume=True,
        )
    )
    config = EvaluateConfig(
        policy=(str(folder),), episodes=design.rollouts, seed=design.seed, label=arm.label
    )
    shares = {"nominal": _evaluate(config, layout, arm, "nominal")}
    if robust and design.robustness:
        fewer = replace(config, episodes=min(design.rollouts, design.robustness.rollouts))
        disturbed = ",".join(design.robustness.perturbations)
        shares["disturbed"] = _evaluate(replace(fewer, perturbation=disturbed), layout, arm, "disturbed")
        if arm.actions == "realised" and design.robustness.protections:
            protected = replace(fewer, protection=",".join(design.robustness.protections))
            shares["protected"] = _evaluate(protected, layout, arm, "protected")
    return {"checkpoint": str(folder.relative_to(layout.root)), "success": shares}


def _evaluate(config: EvaluateConfig, layout: Layout, arm: PolicyArm, what: str) -> dict[str, float]:
    """Run rollouts into a file of their own and return the success of each arm in it."""
    from handrail.datasets.comparison.evaluations import read_evaluations
    from handrail.policies.imitation.evaluation import evaluate

    file = layout.evaluation(arm, what)
    file.parent.mkdir(parents=True, exist_ok=True)
    evaluate(replace(config, json=str(file)))
    arms = read_evaluations([file])
    return {label: float(found.runs()[0].values.mean()) for label, found in arms.items()}


def _compare(task: str, design: StudyDesign, layout: Layout) -> dict[str, Any]:
    """Write the report of a task: its datasets and what the policies did."""
    from handrail.datasets.comparison.compare import compare
    from handrail.datasets.comparison.findings import findings
    from handrail.datasets.comparison.report import write_report

    cells = [Cell(task, mode) for mode in design.modes]
    files = [path for cell in cells for path in layout.evaluations(cell, "nominal")]
    comparison = compare(
        CompareConfig(
            datasets=tuple(str(layout.dataset(cell)) for cell in cells),
            labels=design.modes,
            baseline=design.baseline,
            evaluations=tuple(map(str, files)),
            output=str(layout.comparison(task)),
        )
    )
    write_report(comparison)
    return {"findings": [finding.text for finding in findings(comparison)]}
