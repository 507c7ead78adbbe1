"""Where the files of a LeRobot v3.0 dataset lie.

Episode `i` is file `i % 1000` of chunk `i // 1000` in each of its streams: one parquet of rows, one mp4 a
camera, one parquet that holds the episode's line of metadata. Files of many episodes are named after the
first of them. Two hidden folders are Handrail's own: `.handrail` (files being written, the lock) and
`.damaged` (what `repair` set aside).
"""

import re
from collections.abc import Collection
from pathlib import Path

FILES_IN_A_CHUNK = 1000
DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO_PATH = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
EPISODES_PATH = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
STAGING = ".handrail"
DAMAGED = ".damaged"
FOLDERS = ("data", "videos", "meta")  # of a dataset; what else lies beside them is not touched

NUMBERED = r"chunk-([0-9]{3}|[1-9][0-9]{3,})/file-([0-9]{3})"  # as these patterns write it: one name a file
_OURS = re.compile(
    rf"(\.damaged/[^/]+/)?((data|meta/episodes)/{NUMBERED}\.parquet|videos/(?P<camera>[^/]+)/{NUMBERED}\.mp4)"
    r"|meta/(info\.json|stats\.json|tasks\.parquet|handrail\.json|preview\.webp)"
)


def chunk_and_file(episode: int) -> tuple[int, int]:
    """Return the chunk and the file number of an episode's files."""
    return divmod(episode, FILES_IN_A_CHUNK)


def file_index_of(chunk: int, file: int) -> int:
    """Return the episode after which a file is named, the inverse of `chunk_and_file`."""
    return chunk * FILES_IN_A_CHUNK + file


def episode_of(path: Path) -> int | None:
    """Return which episode a data, video or metadata file belongs to, or None for a stray name."""
    match = re.fullmatch(rf"{NUMBERED}\.(?:parquet|mp4)", "/".join(path.parts[-2:]))
    return file_index_of(int(match[1]), int(match[2])) if match else None


class Layout:
    """The paths of one dataset."""

    def __init__(self, root: Path):
        """Those below a dataset's folder."""
        self.root = root
        meta = root / "meta"
        self.info = meta / "info.json"  # the file that LeRobot opens first
        self.stats = meta / "stats.json"  # the statistics over all episodes
        self.tasks = meta / "tasks.parquet"  # the task sentences
        self.preview = meta / "preview.webp"  # a moving picture for the card
        self.episodes = meta / "episodes"  # the episode rows
        self.manifest = meta / "handrail.json"  # what Handrail keeps of the schema; written once, first
        self.staging = root / STAGING  # files under temporary names, and the lock
        self.damaged = root / DAMAGED  # where `repair` puts what it does not dare to delete

    def data(self, episode: int) -> Path:
        """Return the parquet with the rows of an episode."""
        return self._numbered(DATA_PATH, episode)

    def video(self, key: str, episode: int) -> Path:
        """Return the mp4 of one camera of an episode."""
        return self._numbered(VIDEO_PATH, episode, video_key=key)

    def row(self, episode: int) -> Path:
        """Return the parquet with the metadata of an episode; it exists exactly if the episode is saved."""
        return self._numbered(EPISODES_PATH, episode)

    def relative(self, path: Path) -> str:
        """Return a path inside the dataset as text, with forward slashes."""
        return path.relative_to(self.root).as_posix()

    def foreign(self, features: Collection[str]) -> list[str]:
        """Return all among the files of a dataset with these features, or in quarantine, that is none."""
        tops = [self.root / name for name in (*FOLDERS, DAMAGED)]
        found = {path: path.is_symlink() for top in tops for path in (top, *top.rglob("*"))}
        names = {self.relative(path): linked for path, linked in found.items() if linked or path.is_file()}
        matches = {name: _OURS.fullmatch(name) for name, linked in names.items() if not linked}
        ours = {name for name, match in matches.items() if match and match["camera"] in (None, *features)}
        return sorted(names.keys() - ours)

    def _numbered(self, pattern: str, episode: int, **keys: str) -> Path:
        chunk, file = chunk_and_file(episode)
        return self.root / pattern.format(chunk_index=chunk, file_index=file, **keys)
