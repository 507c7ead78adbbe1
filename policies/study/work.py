"""Does one job of a study; whatever is killed goes on where it was."""

import os
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.controllers.versions import SIMULATION, versions
from handrail.datasets.editing.merge import drop_episodes, merge_datasets
from handrail.datasets.format.layout import Layout
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.quality.measure import measure
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply
from handrail.datasets.reading.digest import digest_of_dataset
from handrail.datasets.reading.load import each_opened, recorded_episodes
from handrail.datasets.reading.reader import read_episodes
from handrail.datasets.storage.atomic import remove
from handrail.datasets.storage.strict_json import known_json, write_json
from handrail.policies.imitation.interface.checkpoint import MODEL, last_checkpoint, read_meta
from handrail.policies.study.design import StudyDesign
from handrail.policies.study.jobs import StudyCell, StudyJob, StudyLayout, StudyPolicy
from handrail.policies.study.progress import has_rollouts
from handrail.policies.study.settings import (
    BATCH,
    FPS,
    evaluations,
    fingerprint,
    recording,
    training,
    wanted,
    way_of,
)

_MOST_ATTEMPTS = 6  # for each success that is wanted


def summary(root: Path, seed: int) -> dict[str, Any]:
    """Return how much was recorded, how it ended, how good it is, and a digest; `seed` is the metrics'."""
    episodes = recorded_episodes(root)
    measured = measure({"all": episodes}, np.random.default_rng(seed)).values
    means = {name: each["all"].estimate for name, each in measured.items()}
    failed = (episode.meta.get("failure_reason") for episode in episodes if not episode.success)
    return {
        "episodes": len(episodes),
        "successes": sum(bool(episode.success) for episode in episodes),
        "minutes": sum(episode.seconds for episode in episodes) / 60.0,
        "steered": sum(map(_steered, each_opened(episodes))) / 60.0,
        "frames": sum(episode.count for episode in episodes),
        "reasons": dict(Counter(str(reason or "not recorded") for reason in failed).most_common()),
        "digest": digest_of_dataset(root),
        "quality": {name: mean for name, mean in means.items() if mean is not None},
    }


def _steered(episode: Demonstration) -> float:
    """Return how long the operator steered, and not only watched a policy [s]."""
    try:
        return episode.seconds * float((episode.numbers("intervention") > 0.0).mean())
    except DoesNotApply:
        return episode.seconds


def do(job: StudyJob, design: StudyDesign, root: Path) -> None:
    """Do a job of a study and write that it is done, what came of it, and what it took.

    Raises:
        HandrailError, OSError: it cannot be done.
    """
    layout, start, spent = StudyLayout(root), time.monotonic(), _processor_time()
    begin(job, design, layout)
    result = work(job, design, layout)
    took = {
        "seconds": round(time.monotonic() - start, 1),
        "processor_seconds": round(_processor_time() - spent, 1),
        "cores": os.cpu_count(),
        "versions": versions(*SIMULATION, "torch"),
        "ended": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    write_json(layout.done(job), {"settings": fingerprint(job, design), "result": result, "took": took})


def _processor_time() -> float:
    """Return the time of a core that this process and those it waited for have used so far [s]."""
    return sum(os.times()[:4])


def begin(job: StudyJob, design: StudyDesign, layout: StudyLayout) -> None:
    """Remove what a job made with other settings before, then note with which it begins.

    A dataset may grow, but never mix two ways to record, and goes where less is wanted; rollouts of other
    conditions go, and those of a policy that is gone; a policy that learnt otherwise goes with all its
    rollouts. What is noted of a job that was done with other settings goes, too.
    """
    settings, before = fingerprint(job, design), known_json(layout.begun(job))
    stale = [path for path in _stale(job, settings, before, layout) if path.exists()]
    if stale and "recording" not in before:
        raise HandrailError(
            f"{job.name}: expected a note of this version on how {stale[0]} was made in "
            f"{layout.begun(job)}, found none; remove what is there, or choose another --output"
        )
    for path in stale:
        Terminal().print(f"removed, made with other settings: {path}")
        remove(path)
    if known_json(layout.done(job)).get("settings") != settings:
        remove(layout.done(job))
    write_json(layout.begun(job), settings)


def _stale(
    job: StudyJob, now: Mapping[str, Any], before: Mapping[str, Any], layout: StudyLayout
) -> list[Path]:
    """Return where something would be that does not go with the settings of now."""
    if job.policy is None:
        less = any(now["wanted"][what] < count for what, count in before.get("wanted", {}).items())
        return [layout.dataset(job.cell)] if less or now["recording"] != before.get("recording") else []
    policy, driven = job.policy, before.get("evaluations", {})
    known = now["evaluations"] | driven
    if any(now[part] != before.get(part) for part in ("recording", "wanted", "training")):
        return [layout.policy(policy), *(layout.evaluation(policy, what) for what in known)]
    gone = last_checkpoint(layout.policy(policy)) is None
    others = [what for what in known if gone or now["evaluations"].get(what) != driven.get(what)]
    return [layout.evaluation(policy, what) for what in others]


def work(job: StudyJob, design: StudyDesign, layout: StudyLayout) -> dict[str, Any]:
    """Do a job and return what is to be known of it when what is large is gone."""
    if job.policy:
        return _train_and_evaluate(job, job.policy, design, layout)
    before = known_json(layout.done(job))
    collect(job, design, layout)
    found = summary(layout.dataset(job.cell), design.seed)
    same = before.get("settings") == fingerprint(job, design)
    expected = before.get("result", {}).get("digest", found["digest"])
    if same and not found["digest"].startswith(expected):  # an earlier version left the pictures out
        Terminal().print(f"recorded again, the rows differ: expected {expected}, got {found['digest']}")
        found["digest_before"] = expected
    return found


def collect(job: StudyJob, design: StudyDesign, layout: StudyLayout) -> None:
    """Record in turns of a few episodes, each by another person, until there is enough.

    In rounds, episodes that do not fit into the operator's time any more are removed, but for the first.
    """
    from handrail.collect.commands.record import record

    cell, root, need = job.cell, layout.dataset(job.cell), wanted(job.cell, design)
    driver = layout.policy(job.before.policy) if job.before and job.before.policy else Path()
    copilot = None
    if way_of(cell, design).arbiter:
        from handrail.policies.imitation.evaluation.copilot import share as copilot
    while True:
        rows = read_episodes(root) if Layout(root).info.is_file() else []
        whole = rows[: len(rows) // BATCH * BATCH]  # in a turn that was interrupted nobody looks
        successes = sum(bool(row["success"]) for row in whole)
        minutes = sum(row["length"] for row in whole) / FPS / 60.0
        if successes >= need["episodes"] and minutes >= need["minutes"]:
            break
        if len(whole) >= _MOST_ATTEMPTS * need["episodes"] and successes < need["episodes"]:
            raise HandrailError(
                f"collecting {cell.name}: expected {need['episodes']} successes, "
                f"got {successes} in {len(whole)} attempts"
            )
        share = min(minutes / need["minutes"], successes / max(1, need["episodes"]))
        code = record(recording(cell, design, root, len(rows), driver, share), copilot)
        if code:
            raise HandrailError(f"collecting {cell.name}: recording ended with exit code {code}")
    if design.rounds:
        ends = np.cumsum([row["length"] for row in rows]) / FPS / 60.0
        count = max(1, np.count_nonzero(ends <= need["minutes"]))
        late = {row["episode_index"] for row in rows[count:]}
        drop_episodes(root, lambda row: row["episode_index"] in late)


def _learnt_from(cell: StudyCell, layout: StudyLayout) -> Path:
    """Return the folder of what a policy learns from: the data of all rounds so far as one."""
    parts, root = [layout.dataset(each) for each in cell.rounds], layout.merged(cell)
    if len(parts) == 1:
        return parts[0]
    remove(root)
    return merge_datasets(parts, root).root


def _is_corrected(root: Path) -> bool:
    """Return whether a person took over in some successful episode: else there is nothing to weigh."""
    learnt = (episode for episode in recorded_episodes(root) if episode.success)
    return any(map(_steered, each_opened(learnt)))


def _remove_without_checkpoints(
    job: StudyJob, policy: StudyPolicy, design: StudyDesign, layout: StudyLayout
) -> None:
    """Remove a trained policy, and how it drove, if an earlier checkpoint that is to drive is gone."""
    last = last_checkpoint(layout.policy(policy))
    if last is None or int(last.name) < design.tasks[policy.cell.task].steps:
        return
    asked = evaluations(job, design, str(last / MODEL))
    files = {what: layout.evaluation(policy, what) for what in asked}
    if any(not (Path(each.policy[0]).is_dir() or has_rollouts(files[w], each)) for w, each in asked.items()):
        for path in (layout.policy(policy), *files.values()):
            remove(path)


def _train_and_evaluate(
    job: StudyJob, policy: StudyPolicy, design: StudyDesign, layout: StudyLayout
) -> dict[str, Any]:
    """Train a policy and let it drive, under every condition into a file of its own."""
    from handrail.policies.imitation.evaluation.evaluation import evaluate
    from handrail.policies.imitation.training.training import train

    start, root = time.monotonic(), _learnt_from(policy.cell, layout)
    config = training(policy, design, root, layout.policy(policy))
    if config.corrections == "weighted" and not _is_corrected(root):
        config = replace(config, corrections="all")
    _remove_without_checkpoints(job, policy, design, layout)
    folder = train(config)
    remove(layout.merged(policy.cell))
    trained = time.monotonic()
    for what, config in evaluations(job, design, str(folder)).items():
        file = layout.evaluation(policy, what)
        if has_rollouts(file, config):
            continue  # its checkpoint may be gone
        file.parent.mkdir(parents=True, exist_ok=True)
        evaluate(replace(config, json=str(file)))
    meta = read_meta(folder)
    for other in (layout.policy(policy) / "checkpoints").glob("*"):
        if other.name.isdecimal() and other != folder.parent:  # one was needed only to go on from
            remove(other)
    return {
        "steps": meta.steps,
        "trained_on": dict(meta.trained_on),
        "data": meta.data,
        "training_seconds": round(trained - start, 1),
        "rollout_seconds": round(time.monotonic() - trained, 1),
    }
