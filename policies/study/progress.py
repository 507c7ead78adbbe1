"""How a study stands: which jobs were done with its present settings, and what came of them."""

from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.evaluations import read_evaluations
from handrail.datasets.reading.reader import read_info
from handrail.datasets.storage.strict_json import known_json, write_json
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.interface.checkpoint import last_checkpoint
from handrail.policies.study.design import StudyDesign
from handrail.policies.study.jobs import StudyJob, StudyLayout, jobs
from handrail.policies.study.settings import evaluations, fingerprint


@dataclass(frozen=True)
class StudyProgress:
    """The finished jobs of a study; missing ones, and those made with other settings, are left out."""

    design: StudyDesign
    layout: StudyLayout

    @cached_property
    def done(self) -> frozenset[str]:
        """Names of the jobs that are done, as they were when this was first asked."""
        return frozenset(job.name for job in self.jobs if self._is_done(job))

    @property
    def missing(self) -> list[str]:
        """Names of the jobs that are not."""
        return [job.name for job in self.jobs if job.name not in self.done]

    def todo(self, only: str = "") -> list[StudyJob]:
        """Return the jobs to be done, of one cell or all: what is missing, and what that needs.

        A dataset or a policy that is gone is made again only for a job that is still to be done with it.
        """
        todo: list[StudyJob] = []
        needed: set[str] = set()
        for job in reversed(self.jobs):
            if job.name in needed:
                chosen = job.name not in self.done or not self._is_there(job)
            else:
                chosen = job.name not in self.done and only in ("", job.cell.name)
            if chosen:
                todo.append(job)
                needed |= {*job.needs}
        return todo[::-1]

    def _is_done(self, job: StudyJob) -> bool:
        """Return whether a job was done with just these settings, and the small files it made are there.

        Datasets and policies may be gone: what is to be known of them is in the job's note and its rollouts.
        """
        noted, now = self._notes[job.name].get("settings") or {}, fingerprint(job, self.design)
        if (policy := job.policy) is None:
            return noted == now
        driven, asked = noted.get("evaluations", {}), now["evaluations"]
        if noted | {"evaluations": {what: driven.get(what) for what in asked}} != now:  # more do no harm
            return False
        wanted = evaluations(job, self.design)
        return all(has_rollouts(self.layout.evaluation(policy, w), c) for w, c in wanted.items())

    def _is_there(self, job: StudyJob) -> bool:
        """Return whether the policy or the dataset that a job noted is still there, whole."""
        noted = self._notes[job.name].get("result", {})
        if job.policy:
            last = last_checkpoint(self.layout.policy(job.policy))
            return last is not None and int(last.name) == noted.get("steps")
        root = self.layout.dataset(job.cell)
        try:
            return read_info(root).episodes == noted.get("episodes") and any(root.glob("data/*/*.parquet"))
        except HandrailError:
            return False

    @cached_property
    def notes(self) -> dict[StudyJob, dict[str, Any]]:
        """The note of every job that is done, in their order: `settings`, `result`, what it `took`."""
        return {job: self._notes[job.name] for job in self.jobs if job.name in self.done}

    def rollouts(self, job: StudyJob) -> list[Path]:
        """Return the files of the rollouts of a job's policy; none until it is done."""
        if job.policy is None or job.name not in self.done:
            return []
        return [self.layout.evaluation(job.policy, what) for what in evaluations(job, self.design)]

    @cached_property
    def _notes(self) -> dict[str, dict[str, Any]]:
        return {job.name: known_json(self.layout.done(job)) for job in self.jobs}

    @cached_property
    def jobs(self) -> list[StudyJob]:
        """All jobs of the study."""
        return jobs(self.design)


def has_rollouts(file: Path, config: EvaluateConfig) -> bool:
    """Return whether every seed was run under every condition; not where there is no file of them."""
    try:
        conditions, wanted = read_evaluations([file]).values(), set(config.seeds)
    except HandrailError:
        return False
    whole = [policy for each in conditions for policy in each.policies if wanted <= policy.rollouts.keys()]
    return len(conditions) == len(whole) == len(config.protections) * len(config.perturbations)


def note_design(layout: StudyLayout, design: StudyDesign) -> None:
    """Note that the folder is run with a design, unless it was the last one already."""
    known = designs(layout)
    if not known or known[-1]["digest"] != design.digest:
        entry = {"digest": design.digest, "since": datetime.now(UTC).isoformat(timespec="seconds")}
        write_json(layout.designs, {"designs": [*known, entry]})


def designs(layout: StudyLayout) -> list[dict[str, str]]:
    """Return the designs that the folder was run with, the first one first: `digest`, `since`."""
    found = known_json(layout.designs).get("designs", [])
    listed = found if isinstance(found, list) else []
    return [each for each in listed if isinstance(each, dict) and {"digest", "since"} <= each.keys()]
