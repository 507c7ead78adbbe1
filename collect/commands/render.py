"""Pictures for a dataset that was recorded without: its commands run again, and cameras look on.

A replay is exact, so that they are the pictures that recording would have taken. Every number stays as it is.
"""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from handrail.collect.commands.config import RenderConfig
from handrail.collect.commands.replay import replay_one_of
from handrail.collect.config import SessionConfig
from handrail.collect.session.recorded import COLUMN as SETTINGS
from handrail.collect.session.recorded import recorded_settings
from handrail.collect.world.env import Observation
from handrail.controllers.errors import HandrailError
from handrail.datasets.format.episode_rows import read_column_types, row_files
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import read_manifest
from handrail.datasets.format.metadata import is_extra
from handrail.datasets.format.schema import Feature
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.reading.check import check_whole
from handrail.datasets.reading.reader import OpenDataset, open_dataset, read_episodes
from handrail.datasets.recording.folder import is_dataset
from handrail.datasets.recording.frames import PICTURE
from handrail.datasets.recording.writer import EpisodeWriter


def render(config: RenderConfig) -> None:
    """Write a dataset with pictures; one that was begun is gone on with."""
    check_whole(config.root, config.verify)
    with open_dataset(config.root) as dataset:
        seen = {"cameras": config.cameras, "image_size": config.image_size}
        seen |= {"randomise": True} if config.randomise else {}
        for row in dataset.rows:
            replace(recorded_settings(row), **seen).check()
        with _writer(config, dataset) as writer:
            for episode in range(writer.num_episodes, len(dataset.rows)):
                _render(dataset, episode, writer, seen)
            said = f"{config.target}: {writer.num_episodes} episodes, {writer.num_frames} frames"
    Terminal().print(said)


@contextmanager
def _writer(config: RenderConfig, dataset: OpenDataset) -> Iterator[EpisodeWriter]:
    """Provide the writer of the dataset with pictures, new or begun."""
    layout, target = Layout(dataset.info.root), Layout(config.target)
    manifest = read_manifest(layout)
    numbers = {key: each for key, each in manifest.features.items() if not each.is_video}
    look = SessionConfig(robot=_one_robot(dataset), cameras=config.cameras, image_size=config.image_size)
    cameras = {PICTURE + name: Feature("video", (*look.image_shape, 3)) for name in look.camera_names}
    observed = {key: each for key, each in numbers.items() if key.startswith("observation.")}
    name = config.name or manifest.repo_id
    manifest = replace(manifest, repo_id=name, features=observed | cameras | numbers)
    if is_dataset(target):
        begun = [_kind(row, False) for row in read_episodes(target.root)]
        if begun != [_kind(row, config.randomise) for row in dataset.rows][: len(begun)]:
            raise HandrailError(f"--output {config.output}: expected episodes of {config.root}, found others")
        writer = EpisodeWriter.resume(target.root, manifest)
    else:
        writer = EpisodeWriter.create(target.root, manifest, types=read_column_types(row_files(layout)[-1]))
    with writer:
        try:
            yield writer
        finally:
            writer.erase_if_empty()


def _kind(row: Mapping[str, Any], randomise: bool) -> tuple[Any, bool]:
    """Return what says whether an episode is another's: its seed, and whether its looks are drawn."""
    return row.get("seed"), randomise or recorded_settings(row).randomise


def _one_robot(dataset: OpenDataset) -> str:
    robots = {recorded_settings(row).robot for row in dataset.rows}
    if len(robots) != 1:
        raise HandrailError(f"dataset {dataset.info.root}: expected episodes of one robot, got {len(robots)}")
    return robots.pop()


def _render(dataset: OpenDataset, episode: int, writer: EpisodeWriter, seen: Mapping[str, Any]) -> None:
    """Add an episode with what its cameras see; one whose replay is not exact is refused."""
    row, info = dataset.row(episode), dataset.info
    names = [key for key, each in writer.features.items() if not each.is_video]
    columns = dataset.frames(episode, [*names, "task_index"])
    numbers = columns.pop("task_index").tolist()
    sentences = dict(zip(dict.fromkeys(numbers), row["tasks"], strict=True))  # as they come first
    tasks = [sentences[number] for number in numbers]

    def observe(observation: Observation) -> None:
        frame = writer.open_frames
        pictures = {PICTURE + name: each for name, each in observation["pixels"].items()}
        writer.add_frame({name: each[frame] for name, each in columns.items()} | pictures, tasks[frame])

    found, _ = replay_one_of(dataset, episode, seen=seen, observe=observe)
    if found.largest or writer.open_frames != len(tasks):
        writer.discard_episode()
        raise HandrailError(
            f"episode {episode} of {info.root}: expected an exact replay, got one that deviates by "
            f"{found.largest:.1e} at {found.names[int(np.argmax(found.deviations))]}: other versions "
            "recorded it, or a robot's client did"
        )
    extras = {name: value for name, value in row.items() if is_extra(name) and value is not None}
    if extras.get(SETTINGS):
        extras[SETTINGS] = json.dumps(json.loads(extras[SETTINGS]) | seen)
    writer.save_episode(extras)
