"""Runs a study: its jobs wherever the settings say, each in a process of its own."""

from collections.abc import Callable
from pathlib import Path

from handrail.collect.execution.execution import Execution
from handrail.collect.execution.job import Job
from handrail.controllers.errors import FAILED, check_known
from handrail.datasets.presentation.markdown import read_page, with_part
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.lock import FolderLock
from handrail.policies.imitation.config import TrainConfig, check_trainable
from handrail.policies.imitation.training.presets import policy_config
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.design import StudyDesign
from handrail.policies.study.jobs import StudyJob, StudyLayout
from handrail.policies.study.power import plan
from handrail.policies.study.progress import StudyProgress, note_design
from handrail.policies.study.settings import load_design
from handrail.policies.study.work import do

_PRELOAD = (
    "handrail.policies.imitation.evaluation.evaluation",
    "handrail.policies.imitation.training.training",
)
Work = Callable[[StudyJob, StudyDesign, Path], None]


def run_study(config: StudyConfig, work: Work = do, isolated: bool = True) -> int:
    """Do what is not done yet, then write the report; return the exit code.

    Args:
        config: of the study.
        work: does a job.
        isolated: whether each job gets a process of its own even where there is one worker.
    """
    config.check()
    design = load_design(config.preset)
    progress, console = StudyProgress(design, StudyLayout(config.folder)), Terminal(stderr=True)
    if config.only:
        check_known(
            "cell of the study", (config.only,), dict.fromkeys(job.cell.name for job in progress.jobs)
        )
    told = f"study {design.name}, design {design.digest}: {len(progress.jobs)} jobs. {plan(design)}"
    console.print(told)
    if config.plan:
        return 0
    if not config.report_only:
        check_trainable("handrail-study", design.policy)
    if config.page:
        with_part(read_page(Path(config.page).expanduser()), f"study {design.name}", "")
    with explained(f"--output {config.output}: expected a folder that can be written"):
        lock = FolderLock(config.folder / ".study", f"study {config.output!r}", "handrail-study")
    with lock:
        done = config.report_only or _work(config, progress, console, work, isolated)
        from handrail.policies.study.report import write_study

        files = write_study(config, StudyProgress(design, progress.layout))
    console.print("Written: " + ", ".join(map(str, files)))
    return 0 if done else FAILED


def _work(
    config: StudyConfig, progress: StudyProgress, console: Terminal, work: Work, isolated: bool
) -> bool:
    """Do what is to be done; return whether nothing failed."""
    design, layout = progress.design, progress.layout
    note_design(layout, design)
    todo = progress.todo(config.only)
    if any(job.policy for job in todo):
        policy_config(TrainConfig(policy=design.policy))  # refuses what LeRobot does not know
    for job in todo:
        with explained(str(layout.log(job))):
            layout.log(job).unlink(missing_ok=True)  # of an earlier time
    jobs = [Job(job.name, work, (job, design, layout.root), job.needs, log=layout.log(job)) for job in todo]
    try:
        with Execution(config, f"study {design.name}", console, _PRELOAD, isolated) as execution:
            results = list(execution.run(jobs))
    except KeyboardInterrupt:
        raise KeyboardInterrupt("study: interrupted; the same command goes on where it was") from None
    return not any(result.error for result in results)
