"""Train, evaluate and study, killed ten times each while they write: what was saved stays, and they go on."""

import contextlib
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from killed_child import killed
from policy_helpers import untrained_act
from study_helpers import SMALLEST
from training_helpers import TINY, tiny, weights, write_dataset

from handrail.datasets.reader import read_episodes
from handrail.policies.imitation.checkpoint import load_policy, read_meta
from handrail.policies.imitation.curve import read_curve
from handrail.policies.imitation.evaluate_config import EvaluateConfig
from handrail.policies.imitation.evaluation import evaluate
from handrail.policies.imitation.training import train
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.run import run_study

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*"),
]
KILLS = 10


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
    flags = [
        "--dataset.root",
        recorded,
        "--output",
        output,
        "--steps",
        60,
        "--batch_size",
        8,
        "--save_freq",
        4,
    ]
    kept: dict[str, str] = {}
    for kill in range(KILLS):
        change = int(rng.integers(2, 40))
        died = killed(output, change, "handrail.scripts.train", *flags, "--resume", "--policy_options", *TINY)
        assert died, f"{kill}: not killed at change {change}"
        now = digests(output)
        assert kept.items() <= now.items()
        for step in {Path(path).parts[1] for path in now}:
            folder = output / "checkpoints" / step / "pretrained_model"
            assert load_policy(folder).policy is not None
            assert read_meta(folder)[1].steps == int(step)
        assert all(np.isfinite(row["loss"]) for row in read_curve(output))
        kept = now
    assert kept, "killed too early to see anything"
    whole = tiny(recorded, tmp_path / "whole", steps=60, save_freq=4)
    resumed = tiny(recorded, output, steps=60, save_freq=4, resume=True)
    assert weights(train(resumed, quiet=True)) == weights(train(whole, quiet=True))


def rows_of(file: Path) -> list[dict]:
    if not file.exists():
        return []
    arms = json.loads(file.read_bytes())["arms"]
    return [row for entries in arms.values() for entry in entries for row in entry["rollouts"]]


def without_times(rows: list[dict]) -> list[dict]:
    return [{key: value for key, value in row.items() if key != "timing"} for row in rows]


def test_an_evaluation_killed_while_it_writes(tmp_path):
    """Law: the file is whole whenever it is there, loses no rollout, and no rollout is run again."""
    policy, file, rng = (
        untrained_act(tmp_path / "policy", "realised"),
        tmp_path / "e.json",
        np.random.default_rng(0),
    )
    count = 40
    flags = ["--policy", policy, "--episodes", count, "--time_limit", 0.2, "--json", file]
    kept: list[dict] = []
    for _ in range(KILLS):
        assert killed(tmp_path / ".e.json", int(rng.integers(1, 8)), "handrail.scripts.evaluate", *flags)
        rows = rows_of(file)
        assert rows[: len(kept)] == kept
        kept = rows
    asked = EvaluateConfig(policy=(policy,), episodes=count, time_limit=0.2)
    finished = evaluate(EvaluateConfig(**{**vars(asked), "json": str(file)}))
    assert rows_of(file)[: len(kept)] == kept
    assert len(rows_of(file)) == count
    ((label, (entry,)),) = finished["arms"].items()
    assert without_times(entry["rollouts"]) == without_times(evaluate(asked)["arms"][label][0]["rollouts"])


def seen(study: Path) -> dict[str, tuple[int, int]]:
    """Return size and time of every file that the jobs of a study make."""
    found = {}
    made = ("datasets", "policies", "evaluations", "comparisons", "done")
    for path in (path for folder in made for path in (study / folder).rglob("*")):
        try:
            if path.is_file():
                found[str(path)] = (path.stat().st_size, path.stat().st_mtime_ns)
        except FileNotFoundError:
            continue
    return found


def killed_study(preset: Path, study: Path, wait: float) -> bool:
    """Begin a study and kill all its processes while its files change; return whether it was at work."""
    words = [sys.executable, "-m", "handrail.scripts.study", "--preset", str(preset), "--output", str(study)]
    before = seen(study)
    with subprocess.Popen(
        words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    ) as process:
        try:
            while process.poll() is None:
                if seen(study).items() - before.items():
                    time.sleep(wait)
                    break
                time.sleep(0.005)
            alive = process.poll() is None
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)  # all that it began too, as a power cut does
    return alive


def test_a_study_killed_while_it_writes(tmp_path):
    """Law: notes of jobs that are done and saved episodes stay, and the same command goes on."""
    preset, study, rng = tmp_path / "tiny.toml", tmp_path / "study", np.random.default_rng(0)
    preset.write_text(SMALLEST)
    done: dict[str, dict] = {}
    episodes: dict[Path, int] = {}
    deaths = 0
    for _ in range(KILLS):
        deaths += killed_study(preset, study, rng.uniform(0.0, 6.0))
        notes = {path.name: json.loads(path.read_bytes()) for path in study.glob("done/**/*.json")}
        assert done.items() <= notes.items()
        done = notes
        for root in study.glob("datasets/*/*"):
            count = len(read_episodes(root)) if (root / "meta" / "info.json").is_file() else 0
            assert count >= episodes.get(root, 0)
            episodes[root] = count
        for file in study.glob("evaluations/**/*.json"):
            assert rows_of(file)
    assert deaths == KILLS
    assert run_study(StudyConfig(preset=str(preset), output=str(study), workers=2)) == 0
    assert episodes, "killed too early to see anything"
    assert len(list(study.glob("done/**/*.json"))) == 2 + 3 + 1  # datasets, policies, the comparison
    assert (study / "report.html").is_file()
