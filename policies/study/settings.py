"""A study's design from its file; the configs that its jobs run with, and what their results depend on."""

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from handrail.collect.config import DatasetConfig, RecordConfig, StoredConfig
from handrail.collect.operators.catalogue import OPERATORS
from handrail.collect.operators.modes import MODES
from handrail.collect.session.perturbations import PICTURES
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError, check_known, restated, unknown_name
from handrail.controllers.robot.description import load_description
from handrail.controllers.strict_toml import read_toml
from handrail.controllers.typed import decoded
from handrail.datasets.format.layout import Layout
from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.interface.checkpoint import as_json
from handrail.policies.imitation.training.presets import resolved
from handrail.policies.study.design import MIXED, MOST_DRAWS, StudyDesign, Way
from handrail.policies.study.jobs import StudyCell, StudyJob, StudyPolicy, jobs

PRESETS = Path(__file__).parent / "presets"
BATCH = 10  # episodes, until the next person has a turn
FPS = 20  # [Hz]
_ROUND = 2 * 10**8  # between the seeds of two rounds' recordings; more than the largest of a draw
_DATASET, _POLICY = Path("dataset"), Path("policy")  # of settings that are only looked at
_RECORDED = ("task", "mode", "noise", "time_limit", "seed")
_LEARNT = (
    *("policy", "actions", "success_only", "episodes", "minutes", "draw", "seed"),
    *("eval_split", "eval_steps"),
)
_GONE = {"patience": 0, "improvement": 0.02}  # of a training no more; what was done with these stays done
_DRIVEN = ("episodes", "seed", "label", "protection", "perturbation", "time_limit")


def load_design(name: str) -> StudyDesign:
    """Return a study by the name of a preset or the path of a TOML file."""
    path = Path(name).expanduser() if name.endswith(".toml") else PRESETS / f"{name}.toml"
    if not path.is_file():
        known = sorted(each.stem for each in PRESETS.glob("*.toml"))
        raise unknown_name("study", name, [*known, "a file that ends in .toml"])
    content, where = read_toml(path, "study"), f"study {name}"
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, default=str)
    own = {"name": path.stem, "digest": hashlib.sha256(text.encode()).hexdigest()[:16]}
    for entry in own.keys() & content.keys():
        raise HandrailError(f"{where}: expected no {entry}: it follows from the rest and the file's name")
    if isinstance(tasks := content.get("tasks"), Mapping):
        check_known("task", tasks, TASKS)
    design = decoded({**content, **own}, StudyDesign, where)
    design.check()
    check_jobs(design)
    return design


def seed_of(design: StudyDesign, cell: StudyCell) -> int:
    """Return the seed of a draw, of its recordings and of its rollouts: the same for every mode."""
    return MOST_DRAWS * design.seed + cell.draw


def way_of(cell: StudyCell, design: StudyDesign) -> Way:
    """Return how the operator's time is spent in a cell."""
    return design.rounds.ways[cell.mode] if design.rounds and cell.before else Way()


def wanted(cell: StudyCell, design: StudyDesign) -> dict[str, float]:
    """Return how many successful episodes a dataset has at least, and minutes of the operator's time."""
    task = design.tasks[cell.task]
    if cell.before:
        return {"episodes": 0, "minutes": task.round_minutes}
    return {"episodes": task.episodes, "minutes": task.minutes}


def recording(
    cell: StudyCell,
    design: StudyDesign,
    root: Path,
    so_far: int = 0,
    driver: Path = _POLICY,
    share: float = 0.0,
) -> RecordConfig:
    """Return how the next turn of a dataset is recorded.

    Args:
        cell: of the dataset.
        design: of the study.
        root: of the dataset.
        so_far: number of its episodes.
        driver: folder of the policy that drives, where one does.
        share: of all that is wanted, which is there.
    """
    way = way_of(cell, design)
    beside: dict[str, Any] = {"policy": (str(driver),), "arbiter": way.arbiter} if way.arbiter else {}
    return RecordConfig(
        task=cell.task,
        mode=cell.rounds[0].mode_at(share),
        operator=way.operator,
        person=1 + cell.draw * design.persons + so_far // BATCH % design.persons,
        seed=seed_of(design, cell) + _ROUND * (len(cell.rounds) - 1),
        time_limit=design.tasks[cell.task].time_limit,
        dataset=DatasetConfig(
            repo_id=f"study/{cell.task}-{cell.kind}",
            root=str(root),
            num_episodes=BATCH - so_far % BATCH,
            fps=FPS,
        ),
        resume=Layout(root).manifest.is_file(),
        workers=1,  # a job has one core
        **beside,
    )


def training(policy: StudyPolicy, design: StudyDesign, dataset: Path, output: Path) -> TrainConfig:
    """Return how a policy is trained."""
    task, timed = design.tasks[policy.cell.task], policy.budget == "time"
    ended: dict[str, Any] = {"save_freq": design.curve[0]} if design.curve else {}
    return TrainConfig(
        dataset=StoredConfig(root=str(dataset)),
        output=str(output),
        policy=design.policy,
        actions=policy.actions,
        success_only=True,
        steps=task.steps,
        batch_size=task.batch_size,
        seed=policy.cell.draw,
        draw=policy.cell.draw,
        minutes=(policy.minutes or task.minutes) if timed and not design.rounds else 0.0,
        corrections=way_of(policy.cell, design).corrections,
        episodes=0 if timed else task.episodes,
        encoder=design.encoders.get(policy.cell.task, ""),
        resume=True,
        **ended,
    )


def evaluations(job: StudyJob, design: StudyDesign, folder: str = "policy") -> dict[str, EvaluateConfig]:
    """Return how the policy of a job, in a folder, is driven, by condition."""
    policy, more = job.policy, design.robustness
    assert policy is not None
    common: dict[str, Any] = {
        "policy": (folder,),
        "seed": seed_of(design, policy.cell),
        "label": policy.label,
        "time_limit": design.tasks[policy.cell.task].rollout_limit,
        "workers": 1,  # a job has one core
    }
    found, at = {"nominal": EvaluateConfig(episodes=design.rollouts, **common)}, Path(folder)
    for updates in design.curve if policy == StudyPolicy(policy.cell) else ():
        place = at.parent.parent / str(updates).zfill(len(at.parent.name)) / at.name
        here = {"policy": (str(place),), "label": f"{policy.label} {after(updates)}"}
        found[f"after-{updates}"] = EvaluateConfig(episodes=design.rollouts, **common | here)
    if job.robust and more:
        common["episodes"] = min(design.rollouts, more.rollouts)
        if more.perturbations:
            found["disturbed"] = EvaluateConfig(perturbation=",".join(more.perturbations), **common)
        is_intent = policy.actions == "intent"
        if protections := [each for each in more.protections if (each == "none") == is_intent]:
            found["protected"] = EvaluateConfig(protection=",".join(protections), **common)
    return found


def after(updates: int) -> str:
    """Return what rollouts are called of a policy that has learnt less than it will."""
    return f"after {updates} updates"


def fingerprint(job: StudyJob, design: StudyDesign) -> dict[str, Any]:
    """Return all settings that a job's result depends on, as JSON has them, nothing left to a preset.

    Of a dataset `recording` says what it is; `wanted` may grow. A policy depends on both, on its `training`
    and on its `evaluations`.
    """
    cell, config = job.cell, recording(job.cell, design, _DATASET)
    recorded = _some(config, _RECORDED) | {
        "mode": cell.rounds[0].mode,
        "persons": design.persons,
        "turn": BATCH,
        "fps": config.dataset.fps,
    }
    if job.before:
        before = fingerprint(job.before, design)
        recorded |= _some(config, ("operator", "arbiter"))
        recorded["before"] = {part: before[part] for part in ("recording", "wanted", "training")}
    if MIXED in cell.mode:  # how much there shall be says when the mode changes
        recorded["halves"] = wanted(cell, design)
    found = {"recording": recorded, "wanted": wanted(cell, design)}
    if job.policy is None:
        return found
    learnt = training(job.policy, design, _DATASET, _POLICY)
    trained = _GONE | _some(learnt, (*_LEARNT, "corrections") if job.before else _LEARNT)
    if design.curve and job.policy == StudyPolicy(cell):  # of what is done the checkpoints are gone
        trained |= {"curve": list(design.curve)}
    if learnt.encoder:
        from handrail.policies.imitation.interface.encoder import find_encoder

        trained |= {"encoder": learnt.encoder, "weights": find_encoder(learnt.encoder).digest}
    driven = {what: _some(each, _DRIVEN) for what, each in evaluations(job, design).items()}
    return found | {"training": trained | {"sizes": as_json(resolved(learnt))}, "evaluations": driven}


def check_jobs(design: StudyDesign) -> None:
    """Check the settings of every job of a study before one begins."""
    described = cache(load_description)
    for job in jobs(design):
        with restated(f"study {design.name}, {job.name}", HandrailError):
            (recorded := recording(job.cell, design, _DATASET)).check()
            for mode in job.cell.rounds[0].mode.split(MIXED):
                described(recorded.robot).check_hands(f"mode {mode}", MODES[mode].hands)
            if OPERATORS.find(recorded.operator).interactive:
                words = "expected a script or a supervisor of each way, got"
                raise HandrailError(f"operator: {words} {recorded.operator}")
            if job.policy:
                training(job.policy, design, _DATASET, _POLICY).check()
                for config in evaluations(job, design).values():
                    config.check()
                    seen = [
                        each.text
                        for each in config.perturbations
                        if not each.sizes.keys().isdisjoint(PICTURES)
                    ]
                    if seen and not design.encoders:
                        raise HandrailError(
                            f"perturbations: expected encoders for {', '.join(seen)}, got none"
                        )


def _some(config: Any, names: tuple[str, ...]) -> dict[str, Any]:
    return {name: getattr(config, name) for name in names}
