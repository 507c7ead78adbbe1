"""What the tests of studies share: a small design, and jobs that only leave their files, made up."""

import dataclasses
import functools
import shutil
import tempfile
from pathlib import Path

import numpy as np
from datasets_helpers import create, frame_of

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.evaluations import FORMAT
from handrail.policies.study.design.jobs import Layout, jobs
from handrail.policies.study.design.load import load_design
from handrail.policies.study.design.progress import write_json
from handrail.policies.study.design.settings import evaluations, fingerprint
from handrail.policies.study.execution.run import run_study

DESIGN = """
modes = ["ee", "direct"]
baseline = "direct"
seeds = [0, 1]
rollouts = 40
[tasks.reach]
episodes = 5
minutes = 0.1
steps = 10
[robustness]
perturbations = ["push"]
protections = ["filter"]
rollouts = 20
seeds = [0, 1]
[sweep]
tasks = ["reach"]
noises = [0.0]
seeds = [0]
"""

SMALLEST = """
modes = ["ee", "direct"]
baseline = "direct"
seeds = [0]
rollouts = 3
persons = 2
[tasks.reach]
episodes = 2
minutes = 0.3
rollout_limit = 1.5
steps = 20
[robustness]
perturbations = ["push"]
protections = ["filter"]
rollouts = 2
"""  # of real jobs


@functools.cache
def recorded():
    """Record once what every job of recording leaves; it is gone when the tests are over."""
    folder = tempfile.TemporaryDirectory()
    with create(Path(folder.name, "set")) as writer:
        for episode in range(6):
            for index in range(12):
                writer.add_frame(frame_of(episode, index, cameras=False), "reach")
            writer.save_episode({"success": episode > 0, "failure_reason": "timeout", "seed": episode})
    return folder


def make(job, design, layout):
    """Leave the files that a job leaves, made up: the better the operator, the better the policy."""
    if job.cell:
        shutil.copytree(Path(recorded().name, "set"), layout.dataset(job.cell))
    if job.policy:
        rng = np.random.default_rng(job.policy.seed)
        share = 0.9 if job.policy.cell.mode == "ee" else 0.3
        write_json(layout.policy(job.policy) / "checkpoints/000010/pretrained_model/handrail.json", {})
        for what, config in evaluations(job, design).items():
            rollouts = [
                {"seed": seed, "success": bool(rng.random() < share), "contacts": seed % 2, "length": 3.0}
                for seed in config.seeds
            ]
            ending = {"nominal": "", "disturbed": " pushed", "protected": " filter"}[what]
            entry = {"training_seed": job.policy.seed, "rollouts": rollouts}
            arms = {job.policy.label + ending: [entry]}
            write_json(layout.evaluation(job.policy, what), {"format": FORMAT, "arms": arms})
    if job.task:
        write_json(layout.comparison(job.task) / "report.html", {})
    result = {"episodes": 6} if job.cell else {}
    write_json(layout.begun(job), fingerprint(job, design))
    write_json(layout.done(job), {"settings": fingerprint(job, design), "result": result, "seconds": 0.0})


class Starter:
    """Does jobs that only leave their files, and remembers which; one may fail."""

    def __init__(self, failing=""):
        self.begun, self.failing = [], failing

    def __call__(self, job, design, root):
        layout = Layout(root)
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
    design, layout = load_design(preset), Layout(tmp_path / "study")
    for job in jobs(design):
        make(job, design, layout)
    return design, layout, jobs(design)


def changed(design, **settings):
    """Return a design with other settings of its task."""
    return dataclasses.replace(
        design, tasks={"reach": dataclasses.replace(design.tasks["reach"], **settings)}
    )
