"""How a study stands: which jobs were done with its present settings and left whole files."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.evaluations import read_evaluations
from handrail.datasets.reading.reader import read_info
from handrail.datasets.storage import strict_json
from handrail.datasets.storage.atomic import write_whole
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.interface.checkpoint import model_folder
from handrail.policies.study.design.design import StudyDesign
from handrail.policies.study.design.jobs import Cell, Job, Layout, jobs
from handrail.policies.study.design.settings import evaluations, fingerprint

_NAMED = 3  # jobs that are not done, in words


@dataclass(frozen=True)
class StudyProgress:
    """What of a study is done; what is missing, or was made with other settings, is left out.

    Attributes:
        design: of the study.
        layout: of its folder.
    """

    design: StudyDesign
    layout: Layout

    @cached_property
    def done(self) -> frozenset[str]:
        """Names of the jobs that are done, as they were when this was first asked."""
        return frozenset(job.name for job in self._jobs if is_done(job, self.design, self.layout))

    @property
    def missing(self) -> list[str]:
        """Names of the jobs that are not."""
        return [job.name for job in self._jobs if job.name not in self.done]

    @property
    def words(self) -> str:
        """How many jobs are not done, and which; empty if there is none."""
        missing = self.missing
        if not missing:
            return ""
        named = ", ".join(missing[:_NAMED]) + (", …" if len(missing) > _NAMED else "")
        verb = "is" if len(missing) == 1 else "are"
        return f"{len(missing)} of {len(self._jobs)} jobs {verb} not done yet: {named}"

    def dataset(self, cell: Cell) -> Path | None:
        """Return the folder of a dataset, None until it is collected."""
        done = any(job.cell == cell and job.name in self.done for job in self._jobs)
        return self.layout.dataset(cell) if done else None

    def evaluations(self, cell: Cell, what: str) -> list[Path]:
        """Return the files of the rollouts of a cell's policies under some condition."""
        return [
            self.layout.evaluation(job.policy, what)
            for job in self._jobs
            if job.policy and job.policy.cell == cell and job.name in self.done
            if what in evaluations(job, self.design)
        ]

    @cached_property
    def _jobs(self) -> list[Job]:
        return jobs(self.design)


def is_done(job: Job, design: StudyDesign, layout: Layout) -> bool:
    """Return whether a job was done with just these settings, and what it made is there."""
    note = read_json(layout.done(job))
    if note.get("settings") != fingerprint(job, design):
        return False
    try:
        if job.cell:
            return _has_dataset(layout.dataset(job.cell), note.get("result") or {})
        if job.policy:
            model_folder(layout.policy(job.policy))
            wanted = evaluations(job, design).items()
            return all(_has_rollouts(layout.evaluation(job.policy, what), each) for what, each in wanted)
        return (layout.comparison(job.task) / "report.html").is_file()
    except HandrailError:
        return False


def _has_dataset(root: Path, result: Mapping[str, Any]) -> bool:
    return read_info(root).episodes >= result.get("episodes", 0) and any(root.glob("data/*/*.parquet"))


def _has_rollouts(file: Path, config: EvaluateConfig) -> bool:
    """Return whether every seed was run under every condition."""
    policies = read_evaluations([file]).values()
    wanted = set(config.seeds)
    whole = [policy for policy in policies for policy in policy.policies if wanted <= policy.rollouts.keys()]
    return len(policies) == len(whole) == len(config.protections) * len(config.perturbations)


def read_json(path: Path) -> dict[str, Any]:
    """Return a JSON object; an empty one if there is none."""
    try:
        content = strict_json.read_json(path)
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON object under its name at once.

    Raises:
        OSError: the disk does not take it.
    """
    write_whole(path, (json.dumps(content, indent=1) + "\n").encode())
