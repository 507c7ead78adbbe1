"""The shards of a recording that is shared: datasets of a few episodes each, and the plan that they follow.

They lie beside the dataset, in `.NAME.shards`, until all are whole and become one dataset. Which episodes a
shard has does not depend on who records it: whatever is cut short goes on with any number of workers.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, repeat
from pathlib import Path
from typing import Any

import pyarrow as pa

from handrail.collect.config import RecordConfig
from handrail.collect.session.recorded import settings_json
from handrail.controllers.errors import HandrailError, message_of
from handrail.datasets.editing.merge import check_alike, merged_encodings, merged_types
from handrail.datasets.editing.source import EditSource
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.lines import rows_of_lines
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import EpisodeRecord
from handrail.datasets.recording.piece import Piece
from handrail.datasets.recording.rewrite import settle, write_anew
from handrail.datasets.storage.atomic import beside, explained, remove, write_whole
from handrail.datasets.storage.strict_json import read_json

FORMAT = "handrail.shards/1"
_FEW = 5  # episodes of a shard at least
_MANY = 1000  # shards of a recording at most


@dataclass(frozen=True)
class Shard:
    """A part of a recording.

    Attributes:
        folder: of its dataset.
        first: number that its first episode will have in the whole dataset.
        episodes: how many it has.
        log: what is said while it is recorded.
    """

    folder: Path
    first: int
    episodes: int
    log: Path

    @property
    def name(self) -> str:
        """Which episodes they are."""
        return f"episodes {self.first} to {self.first + self.episodes - 1}"

    @property
    def saved(self) -> int:
        """How many of them are saved."""
        return len(rows_of_lines(Layout(self.folder)))


class Shards:
    """Where the shards of a recording lie, and which there are.

    Args:
        config: of the recording.
    """

    def __init__(self, config: RecordConfig) -> None:
        self.root = config.dataset.folder.absolute()
        self.folder = beside(self.root, "shards")
        self._episodes = config.dataset.num_episodes
        dataset = {name: getattr(config.dataset, name) for name in ("name", "fps", "single_task")}
        self._settings = json.loads(settings_json(config)) | dataset | {"num_episodes": self._episodes}

    @property
    def begun(self) -> bool:
        """Whether there are any, of this recording or another."""
        return self._plan.is_file()

    def begin(self, first: int) -> None:
        """Take note of what is to be recorded.

        Args:
            first: how many episodes the dataset has already.
        """
        with explained(f"cannot record beside dataset {str(self.root)!r}"):
            content = {"format": FORMAT, "first": first, "settings": self._settings}
            write_whole(self._plan, (json.dumps(content, indent=1) + "\n").encode())

    def check(self) -> None:
        """Check that they are of this recording; finish a merge that was cut short."""
        with explained(f"cannot go on with dataset {str(self.root)!r}"):
            settle(self.root)
        before = self._content["settings"]
        for name, now in self._settings.items():
            if before.get(name) != now:
                raise HandrailError(
                    f"{str(self.folder)!r} holds episodes of a recording that was cut short, with {name}"
                    f" {before.get(name)!r}, got {now!r}: the same flags as then finish it;"
                    " remove the folder to give them up"
                )

    @cached_property
    def first(self) -> int:
        """How many episodes the dataset had before."""
        return int(self._content["first"])

    def are_in(self, episodes: int) -> bool:
        """Return whether a dataset with so many episodes has them, and not only what was there before."""
        if episodes not in (self.first, self.first + self._episodes):
            raise HandrailError(
                f"dataset {str(self.root)!r}: expected {self.first} episodes, as when {str(self.folder)!r}"
                f" was begun, found {episodes}; remove the one or the other"
            )
        return episodes > self.first

    @property
    def all(self) -> list[Shard]:
        """The shards, in order."""
        size, end = max(_FEW, -(-self._episodes // _MANY)), self.first + self._episodes
        return [
            Shard(
                self.folder / f"shard-{first:07d}",
                first,
                min(size, end - first),
                self.folder / f"shard-{first:07d}.log",
            )
            for first in range(self.first, end, size)
        ]

    def merge(self, lines: Callable[[Shard], Sequence[EpisodeRecord]]) -> None:
        """Make one dataset of what was there before and of all shards, in order; nothing is encoded anew.

        Whoever calls has the sole right to write there.

        Args:
            lines: returns the episodes of a shard when it is whole, once; what it raises ends the merge.
        """
        with explained(f"cannot write dataset {str(self.root)!r}"):
            shards = self.all
            begin = lines(shards[0])
            roots = [self.root] * bool(self.first) + [shards[0].folder]
            sources = [EditSource.open(root) for root in roots]
            check_alike(sources[0], sources[-1])
            manifest, types = sources[0].manifest, merged_types(sources)
            found = chain([begin], map(lines, shards[1:]))
            new = chain.from_iterable(map(_pieces, shards, found, repeat(manifest)))
            pieces = chain(sources[0].pieces() if self.first else (), new)
            try:
                write_anew(self.root, manifest, pieces, types, merged_encodings(sources), in_place=True)
            except (pa.ArrowException, ValueError, KeyError) as error:
                raise HandrailError(f"{str(self.folder)!r} cannot be read: {message_of(error)}") from error

    def remove(self) -> None:
        """Remove them; the plan first, so that nobody goes on with a part."""
        with explained(f"cannot remove {str(self.folder)!r}"):
            remove(self._plan)
            remove(self.folder)

    @property
    def _plan(self) -> Path:
        return self.folder / "plan.json"

    @cached_property
    def _content(self) -> dict[str, Any]:
        try:
            content = read_json(self._plan)
            if content["format"] == FORMAT and isinstance(content["settings"], dict):
                return content
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise HandrailError(
                f"{str(self._plan)!r}: expected the plan of a recording, got {error}"
            ) from error
        raise HandrailError(f"{str(self._plan)!r}: expected format {FORMAT}, got {content['format']!r}")


def _pieces(shard: Shard, lines: Sequence[EpisodeRecord], manifest: Manifest) -> Iterator[Piece]:
    """Yield the episodes of a shard."""
    if len(lines) != shard.episodes:
        raise HandrailError(
            f"dataset {str(shard.folder)!r}: expected {shard.episodes} episodes, found {len(lines)}"
        )
    yield from (Piece.of(Layout(shard.folder), manifest, line) for line in lines)
