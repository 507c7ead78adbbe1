"""What the tests of studies share: a small design, and jobs that only leave their files, made up."""

import dataclasses
import shutil
from itertools import product

import numpy as np
from canned import canned
from datasets_helpers import create, frame_of
from places import ROOT

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.evaluations import FORMAT
from handrail.datasets.storage.strict_json import write_json
from handrail.policies.study.jobs import StudyLayout, jobs
from handrail.policies.study.run import run_study
from handrail.policies.study.settings import after, evaluations, fingerprint, load_design

DESIGN, SMALLEST = (
    (ROOT / "tests" / "data" / "studies" / f"{name}.toml").read_text() for name in ("small", "smallest")
)
"""Of jobs that are made up, and of real ones."""


def what_is_recorded(root):
    """Record what every job of recording leaves."""
    with create(root) as writer:
        for episode in range(6):
            for index in range(12):
                writer.add_frame(frame_of(episode, index, cameras=False), "reach")
            writer.save_episode({"success": episode > 0, "failure_reason": "timeout", "seed": episode})


COLLECTED = {
    "episodes": 6,
    "successes": 5,
    "minutes": 1.5,
    "steered": 0.5,
    "frames": 72,
    "reasons": {"timeout": 1},
    "digest": "d1ce",
    "quality": {"length": 3.0, "sparc": -2.5, "interventions": 2.0, "contacts": 0.5, "saturation": 0.1},
}
LEARNT = {
    "steps": 10,
    "trained_on": {"episodes": 5.0, "operator_time": 90.0},
    "data": "da7a",
    "training_seconds": 8.0,
    "rollout_seconds": 2.0,
}


def make(job, design, layout, shares=None):
    """Leave the files that a job leaves, made up: the better the operator, the better the policy.

    Args:
        shares: success by label, of each draw; then datasets and policies are left out, as if they were gone.
    """
    if job.policy is None and shares is None:
        shutil.copytree(canned(what_is_recorded), layout.dataset(job.cell), dirs_exist_ok=True)
    elif job.policy:
        rng = np.random.default_rng(job.cell.draw)
        share = 0.9 if job.cell.mode == "ee" else 0.3
        if shares is not None:
            share = shares[job.policy.label][job.cell.draw]
        write_json(layout.policy(job.policy) / "checkpoints/000010/pretrained_model/handrail.json", {})
        for what, config in evaluations(job, design).items():
            arms = {}
            for perturbation, protection in product(config.perturbations, config.protections):
                rollouts = [made_up(seed, bool(rng.random() < share)) for seed in config.seeds]
                entry = {"training_seed": job.cell.draw, "dataset_draw": job.cell.draw, "rollouts": rollouts}
                protected = "unprotected" if protection == "none" else protection
                endings = {"protected": protected, "disturbed": perturbation.words, "nominal": ""}
                ending = endings[what] if what in endings else after(int(what.removeprefix("after-")))
                arms[f"{job.policy.label} {ending}".strip()] = [entry]
            write_json(layout.evaluation(job.policy, what), {"format": FORMAT, "arms": arms})
    result = LEARNT if job.policy else COLLECTED
    took = {"seconds": 10.0, "processor_seconds": 9.0, "cores": 2, "ended": "2026-01-01T00:00:00+00:00"}
    write_json(layout.begun(job), fingerprint(job, design))
    write_json(layout.done(job), {"settings": fingerprint(job, design), "result": result, "took": took})


def made_up(seed, success):
    """Return a rollout, which failed while it lifted if it did."""
    row = {"seed": seed, "success": success, "contacts": seed % 2, "length": 3.0}
    return row | {"failure_reason": ""} if success else row | {"failure_reason": "timeout", "stage": "lift"}


class Starter:
    """Does jobs that only leave their files, and remembers which; one may fail."""

    def __init__(self, failing=""):
        self.begun, self.failing = [], failing

    def __call__(self, job, design, root):
        layout = StudyLayout(root)
        needed = [layout.root / "done" / f"{name}.json" for name in job.needs]
        assert all(path.is_file() for path in needed), f"{job.name} began before what it needs"
        self.begun.append(job.name)
        if job.name == self.failing:
            raise HandrailError("of today")
        make(job, design, layout)


def run_here(config, work):
    """Run a study in this process."""
    return run_study(dataclasses.replace(config, workers=1), work, isolated=False)


def everything(tmp_path, preset):
    """Return the design, layout and jobs of a study of which every job is done."""
    design, layout = load_design(preset), StudyLayout(tmp_path / "study")
    for job in jobs(design):
        make(job, design, layout)
    return design, layout, jobs(design)


def changed(design, **settings):
    """Return a design with other settings of its task."""
    return dataclasses.replace(
        design, tasks={"reach": dataclasses.replace(design.tasks["reach"], **settings)}
    )
