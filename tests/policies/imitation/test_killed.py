"""Train, evaluate and study, killed ten times each while they write: what was saved stays, and they go on."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from killed_child import killed, run_command
from policy_helpers import untrained_act
from study_helpers import SMALLEST
from training_helpers import TINY, tiny, weights, write_dataset

from handrail.datasets.reading.reader import read_episodes, read_frames
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.evaluation import evaluate
from handrail.policies.imitation.interface.checkpoint import read_meta
from handrail.policies.imitation.interface.trained import load_policy
from handrail.policies.imitation.training.curve import read_curve
from handrail.policies.imitation.training.training import train
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.jobs import StudyLayout, jobs
from handrail.policies.study.run import run_study
from handrail.policies.study.settings import load_design
from handrail.policies.study.work import do

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*"),
]
KILLS = 10
NEVER = 10**9


def digests(folder: Path) -> dict[str, str]:
    """Return what tells apart the files of every checkpoint that has its name."""
    steps = [
        path for path in (folder / "checkpoints").glob("*") if path.name.isdigit() and not path.is_symlink()
    ]
    files = [path for step in steps for path in step.rglob("*") if path.is_file()]
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def test_a_training_killed_while_it_writes(tmp_path):
    """Law: a checkpoint that has its name is whole and stays; the end is to the bit the same."""
    recorded, output, rng = write_dataset(tmp_path / "set"), tmp_path / "killed", np.random.default_rng(0)
    flags = f"--dataset.root {recorded} --output {output} --steps 60 --batch_size 8 --save_freq 4 --resume"
    words = ("train", *flags.split(), "--policy_options", *TINY)
    kept: dict[str, str] = {}
    for kill in range(KILLS):
        change = int(rng.integers(2, 40))
        assert killed(output, change, run_command, *words), f"{kill}: not killed at change {change}"
        now = digests(output)
        assert kept.items() <= now.items()
        for step in {Path(path).parts[1] for path in now}:
            folder = output / "checkpoints" / step / "pretrained_model"
            assert load_policy(folder).policy is not None
            assert read_meta(folder).steps == int(step)
        assert all(np.isfinite(row["loss"]) for row in read_curve(output))
        kept = now
    assert kept, "killed too early to see anything"
    whole = tiny(recorded, tmp_path / "whole", steps=60, save_freq=4)
    resumed = tiny(recorded, output, steps=60, save_freq=4, resume=True)
    assert weights(train(resumed)) == weights(train(whole))


def rows_of(file: Path) -> list[dict]:
    if not file.exists():
        return []
    arms = json.loads(file.read_bytes())["arms"]
    return [row for entries in arms.values() for entry in entries for row in entry["rollouts"]]


def without_times(rows: list[dict]) -> list[dict]:
    return [{key: value for key, value in row.items() if key != "timing"} for row in rows]


def test_an_evaluation_killed_while_it_writes(tmp_path):
    """Law: the file is whole whenever it is there, loses no rollout, and no rollout is run again."""
    policy, file = untrained_act(tmp_path / "policy", "realised"), tmp_path / "e.json"
    count, rng = 40, np.random.default_rng(0)
    flags = ["--policy", policy, "--episodes", count, "--time_limit", 0.2, "--json", file, "--workers", 1]
    kept: list[dict] = []
    for _ in range(KILLS):
        assert killed(tmp_path / ".e.json", int(rng.integers(1, 8)), run_command, "evaluate", *flags)
        rows = rows_of(file)
        assert rows[: len(kept)] == kept
        kept = rows
    asked = EvaluateConfig(policy=(policy,), episodes=count, time_limit=0.2, workers=1)
    finished = evaluate(EvaluateConfig(**{**vars(asked), "json": str(file)}))
    assert rows_of(file)[: len(kept)] == kept
    assert len(rows_of(file)) == count
    ((label, (entry,)),) = finished["arms"].items()
    assert without_times(entry["rollouts"]) == without_times(evaluate(asked)["arms"][label][0]["rollouts"])


def kept_of(study: Path) -> set[str]:
    """Return what is saved of a study, a text each: notes of jobs, episodes, checkpoints, rollouts."""
    found = {f"{path} {path.read_text()}" for path in study.glob("done/**/*.json")}
    for info in study.glob("datasets/*/*/meta/info.json"):
        root = info.parents[1]
        for row in read_episodes(root):
            number = row["episode_index"]
            action = read_frames(root, number)["action"].tobytes()
            found.add(f"{root} {number} {hashlib.sha256(action).hexdigest()}")
    for checkpoints in study.glob("policies/**/checkpoints"):
        found |= {f"{checkpoints} {item}" for item in digests(checkpoints.parent).items()}
    for file in study.glob("evaluations/**/*.json"):
        found |= {f"{file} {row}" for row in rows_of(file)}
    return found


def nothing_left(job, design, root):
    raise AssertionError(f"{job.name} is not done")


def test_a_study_killed_while_it_writes(tmp_path):
    """Law: whatever a job has saved stays, and the same job goes on; every job is killed twice."""
    preset, study, rng = tmp_path / "tiny.toml", tmp_path / "study", np.random.default_rng(0)
    preset.write_text(SMALLEST)
    design, layout, kills = load_design(str(preset)), StudyLayout(study), 0
    kept: set[str] = set()
    for job in jobs(design):
        for change in (*rng.integers(5, 60, 2).tolist(), NEVER):
            if layout.done(job).is_file():
                break
            kills += killed(study, change, do, job, design, study)
            now = kept_of(study)
            assert kept <= now, job.name
            kept = now
        assert layout.done(job).is_file(), job.name
    assert kills >= KILLS
    assert run_study(StudyConfig(preset=str(preset), output=str(study), workers=2), nothing_left) == 0
    assert (study / "report.html").is_file()
