"""Pictures for a dataset that was recorded without: its commands run again, and cameras look on.

A replay is exact, so that they are the pictures that recording would have taken. Every number stays as it is.
Parts of a few episodes lie beside the dataset, in `.NAME.pictures`, until all are there and become one; which
episodes a part has does not depend on who draws it.
"""

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from handrail.collect.commands.config import RenderConfig
from handrail.collect.commands.replay import replay_one_of
from handrail.collect.config import SessionConfig
from handrail.collect.execution.execution import Execution
from handrail.collect.execution.job import part_jobs
from handrail.collect.execution.pool import RENDERING
from handrail.collect.session.recorded import COLUMN as SETTINGS
from handrail.collect.session.recorded import recorded_settings
from handrail.collect.world.env import Observation
from handrail.controllers.errors import HandrailError
from handrail.datasets.editing.merge import merge_datasets
from handrail.datasets.format.episode_rows import read_column_types, row_files
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest, read_manifest
from handrail.datasets.format.metadata import is_extra
from handrail.datasets.format.schema import Feature
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.reading.check import check_whole
from handrail.datasets.reading.reader import OpenDataset, open_dataset, read_episodes, read_info
from handrail.datasets.recording.folder import check_target, is_dataset
from handrail.datasets.recording.frames import PICTURE
from handrail.datasets.recording.slice import TRIMMED
from handrail.datasets.recording.writer import EpisodeWriter
from handrail.datasets.storage.atomic import beside, explained, remove
from handrail.datasets.storage.lock import FolderLock

_PICTURES = 32  # of a preview
_WIDTH = 320  # of one of them [px]
_LONGEST = 125  # that a picture stays [ms]; a long episode goes by faster than it was


def render(config: RenderConfig) -> None:
    """Write a dataset with pictures; one that was begun is gone on with."""
    check_whole(config.root, config.verify)
    with explained(f"--output {config.output}: cannot be written"):
        alone = FolderLock(beside(config.target, "lock"), f"--output {config.output}", "handrail-edit render")
    with alone:
        _render(config)
    info = read_info(config.target)
    Terminal().print(f"{config.target}: {info.episodes} episodes, {info.frames} frames")


def _render(config: RenderConfig) -> None:
    with open_dataset(config.root) as dataset:
        for settings in dict.fromkeys(recorded_settings(row, config.said) for row in dataset.rows):
            replace(settings, **config.seen).check()
        first, end = _begun(config, dataset), len(dataset.rows)
    folder = beside(config.target, "pictures")
    jobs = part_jobs(draw, config, folder / "part", first, end)
    with Execution(config, "drawing", Terminal(stderr=True), RENDERING) as execution:
        for result in execution.run(jobs):
            if result.error:
                drawn = any(row_files(Layout(job.arguments[1])) for job in jobs)
                if not drawn:
                    remove(folder)
                kept = f"; drawn pictures are kept in {folder}, and the same command goes on"
                raise HandrailError(result.error + kept * drawn)
    if jobs:
        parts = [job.arguments[1] for job in jobs]
        merge_datasets([*[config.target] * bool(first), *parts], config.target, config.name)
    with explained(f"cannot remove {str(folder)!r}"):
        remove(folder)


def _begun(config: RenderConfig, dataset: OpenDataset) -> int:
    """Return how many episodes have their pictures; an output that is of something else is refused."""
    layout, manifest = Layout(config.target), _manifest(config, dataset)
    if not is_dataset(layout):
        check_target(layout, overwrite=False)
        return 0
    manifest.check_fits(read_manifest(layout), f"--output {config.output}: cannot add to it")
    there = _which(read_episodes(config.target), config)
    if there != _which(dataset.rows[: len(there)], config, config.randomise):
        raise HandrailError(f"--output {config.output}: expected episodes of {config.root}, found others")
    return len(there)


def _which(
    rows: Sequence[Mapping[str, Any]], config: RenderConfig, randomise: bool = False
) -> list[tuple[Any, ...]]:
    """Return what tells episodes from others, also from those of the same seeds or with other looks."""
    names = ("seed", "started", "length", "success", "failure_reason", "tasks")
    looks = [randomise or recorded_settings(row, config.said).randomise for row in rows]
    return [(*map(row.get, names), look) for row, look in zip(rows, looks, strict=True)]


def _manifest(config: RenderConfig, dataset: OpenDataset) -> Manifest:
    """Return the schema of the dataset with pictures."""
    manifest = read_manifest(Layout(config.root))
    numbers = {key: each for key, each in manifest.features.items() if not each.is_video}
    look = SessionConfig(robot=_one_robot(dataset, config), **config.seen)
    cameras = {PICTURE + name: Feature("video", (*look.image_shape, 3)) for name in look.camera_names}
    observed = {key: each for key, each in numbers.items() if key.startswith("observation.")}
    name = config.name or manifest.repo_id
    return replace(manifest, repo_id=name, features=observed | cameras | numbers)


def draw(config: RenderConfig, part: Path, first: int, episodes: int) -> None:
    """Write some episodes with pictures as a dataset of their own; one that was begun is gone on with.

    Args:
        config: of all.
        part: folder of that dataset.
        first: number of its first episode in the whole.
        episodes: how many it has.
    """
    with open_dataset(config.root) as dataset:
        layout, manifest = Layout(part), _manifest(config, dataset)
        there = _which(read_episodes(part), config) if row_files(layout) else []
        wanted = _which(dataset.rows[first : first + episodes], config, config.randomise)
        if there and there == wanted[: len(there)] and read_manifest(layout).features == manifest.features:
            writer = EpisodeWriter.resume(part, manifest)
        else:
            types = read_column_types(row_files(Layout(config.root))[-1])
            writer = EpisodeWriter.create(part, manifest, overwrite=True, types=types)
        with writer:
            for episode in range(first + writer.num_episodes, first + episodes):
                _draw(dataset, episode, writer, config)


def _one_robot(dataset: OpenDataset, config: RenderConfig) -> str:
    robots = {recorded_settings(row, config.said).robot for row in dataset.rows}
    if len(robots) != 1:
        raise HandrailError(f"dataset {dataset.info.root}: expected episodes of one robot, got {len(robots)}")
    return robots.pop()


def _draw(dataset: OpenDataset, episode: int, writer: EpisodeWriter, config: RenderConfig) -> None:
    """Add an episode with what its cameras see; one whose replay is not exact is refused."""
    row = dataset.row(episode)
    names = [key for key, each in writer.features.items() if not each.is_video]
    columns = dataset.frames(episode, [*names, "task_index"])
    numbers = columns.pop("task_index").tolist()
    sentences = dict(zip(dict.fromkeys(numbers), row["tasks"], strict=True))  # as they come first
    tasks = [sentences[number] for number in numbers]

    def observe(observation: Observation) -> None:
        frame = writer.open_frames
        pictures = {PICTURE + name: each for name, each in observation["pixels"].items()}
        writer.add_frame({name: each[frame] for name, each in columns.items()} | pictures, tasks[frame])

    found, _ = replay_one_of(dataset, episode, said=config.said, seen=config.seen, observe=observe)
    if found.largest or writer.open_frames != len(tasks):
        writer.discard_episode()
        trimmed = "its beginning was trimmed, so draw before you trim"
        why = trimmed if row.get(TRIMMED) else "other versions recorded it, or a robot's client did"
        raise HandrailError(
            f"episode {episode} of {dataset.info.root}: expected an exact replay, got one that deviates by "
            f"{found.largest:.1e} at {found.names[int(np.argmax(found.deviations))]}: {why}"
        )
    extras = {name: value for name, value in row.items() if is_extra(name) and value is not None}
    if extras.get(SETTINGS):
        extras[SETTINGS] = json.dumps(json.loads(extras[SETTINGS]) | config.seen)
    writer.save_episode(extras)


def preview(root: Path) -> bytes:
    """Return the first episode that succeeded, else the first, as a moving WebP from the scene's camera."""
    with open_dataset(root) as dataset:
        number = next((row["episode_index"] for row in dataset.rows if row.get("success")), 0)
        seconds = dataset.row(number)["length"] / dataset.info.fps
        found, pictures = replay_one_of(dataset, number, _PICTURES)
    if found.largest:
        raise HandrailError(f"episode {number} of {root}: expected an exact replay, got another motion")
    first, *others = [Image.fromarray(picture) for picture in pictures]
    for image in (first, *others):
        image.thumbnail((_WIDTH, _WIDTH))
    stay, stream = min(round(1000 * seconds / _PICTURES), _LONGEST), io.BytesIO()
    first.save(stream, "WEBP", save_all=True, append_images=others, duration=stay, loop=0, quality=70)
    return stream.getvalue()
