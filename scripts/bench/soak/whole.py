"""The saved content of a disk, episode by episode, each with a digest of all its rows and pictures."""

import hashlib
import json
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.episode_rows import count_rows
from handrail.datasets.format.layout import Layout
from handrail.datasets.reading.digest import CLOCKS, add_frames, digest_of_pictures
from handrail.datasets.reading.reader import open_dataset

_PLACES = ("index", "episode_index")  # where an episode is in its dataset
_TRIES = 5  # a file may get another name meanwhile

Saved = dict[int, str]  # episode: digest


def saved_in(root: Path, first: int = 0) -> Saved:
    """Return the episodes of a dataset; none, where there is none yet.

    Args:
        root: of the dataset.
        first: number of its first episode in the whole recording.
    """
    if not Layout(root).info.is_file():
        return {}
    found = {}
    with open_dataset(root) as dataset:
        for row in dataset.rows:
            digest, frames = hashlib.sha256(), dataset.frames(row["episode_index"])
            add_frames(digest, {name: frames[name] for name in frames.keys() - {*CLOCKS, *_PLACES}})
            digest.update(digest_of_pictures(dataset.info, [row]).encode())
            found[first + row["episode_index"]] = digest.hexdigest()[:16]
    return found


def saved_by(root: Path) -> Saved:
    """Return the episodes that a recording has saved, in its dataset and in its shards."""
    for chance in range(_TRIES):
        try:
            found = {}
            for shard in sorted(root.parent.glob(f".{root.name}.shards/shard-*/")):
                found |= saved_in(shard, int(shard.name.removeprefix("shard-")))
            return found | saved_in(root)
        except (HandrailError, OSError):
            if chance == _TRIES - 1:
                raise
    return {}


def lines_of(root: Path) -> int:
    """Return how many episodes a recording has saved: quick, and whatever runs."""
    shards = root.parent.glob(f".{root.name}.shards/shard-*/meta/episodes/*/*.parquet")
    return sum(map(count_rows, [*shards, *root.glob("meta/episodes/*/*.parquet")]))


def rollouts_of(file: Path) -> Saved:
    """Return the rollouts of an evaluation's file, their times left out."""
    if not file.exists():
        return {}
    conditions = json.loads(file.read_bytes())["arms"]
    found = {}
    for row in (row for entries in conditions.values() for entry in entries for row in entry["rollouts"]):
        text = json.dumps({key: row[key] for key in row if key != "timing"}, sort_keys=True)
        found[row["seed"]] = hashlib.sha256(text.encode()).hexdigest()[:16]
    return found
