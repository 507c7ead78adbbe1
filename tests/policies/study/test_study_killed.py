"""What is left of a study that was killed, or changed, is gone on with as if nothing had been."""

from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import pytest
from study_helpers import DESIGN, changed, everything

from handrail.datasets.format.layout import Layout
from handrail.policies.study import work as work_module
from handrail.policies.study.jobs import StudyLayout, jobs
from handrail.policies.study.settings import evaluations, load_design
from handrail.policies.study.work import collect, work


@pytest.mark.parametrize("gone", [False, True])
def test_a_policy_whose_earlier_checkpoints_are_gone_drives_no_more_or_learns_anew(
    gone, tmp_path, preset, monkeypatch
):
    """Its rollouts after fewer updates are there, and are not asked for again; or the policy is made anew."""
    Path(preset).write_text(DESIGN.replace("rollouts = 40", "rollouts = 40\ncurve = [5]"))
    design, layout, found = everything(tmp_path, preset)
    job = next(job for job in found if job.policy)
    place, driven = layout.policy(job.policy), []
    last = place / "checkpoints/000010/pretrained_model"
    if gone:
        layout.evaluation(job.policy, "after-5").unlink()

    def train(config):
        assert place.exists() is not gone
        return last

    monkeypatch.setattr("handrail.policies.imitation.training.training.train", train)
    monkeypatch.setattr(
        "handrail.policies.imitation.evaluation.evaluation.evaluate", lambda config: driven.append(config)
    )
    monkeypatch.setattr(
        work_module, "read_meta", lambda folder: SimpleNamespace(steps=1, trained_on={}, data="")
    )
    work(job, design, layout)
    assert len(driven) == (len(evaluations(job, design)) if gone else 0)


@pytest.mark.parametrize("killed", [None, 7, 10, 13, 19])
def test_a_recording_that_was_killed_ends_where_another_does(killed, tmp_path, preset, monkeypatch):
    design, layout, rows = changed(load_design(preset), episodes=12), StudyLayout(tmp_path), []
    (job, *_) = jobs(design)
    info = Layout(layout.dataset(job.cell)).info
    info.parent.mkdir(parents=True)
    info.touch()

    def record(config, share=None):
        for _ in range(config.dataset.num_episodes):
            rows.append({"success": True, "length": 50})
            if len(rows) == killed:
                raise KeyboardInterrupt
        return 0

    monkeypatch.setattr("handrail.collect.commands.record.record", record)
    monkeypatch.setattr(work_module, "read_episodes", lambda root: list(rows))
    with suppress(KeyboardInterrupt):
        collect(job, design, layout)
    collect(job, design, layout)
    assert len(rows) == 20
