"""First pictures of the cameras, small, for the page."""

import io
from typing import Any

from handrail.controllers.regular_file import regular
from handrail.datasets.comparison.groups import Group
from handrail.datasets.demonstrations.episode import Episode
from handrail.datasets.format.path_pattern import fill
from handrail.datasets.format.schema import video_keys
from handrail.datasets.presentation.drawing import address
from handrail.datasets.reading.reader import DatasetInfo

_EPISODES = 3  # shown of each group
_WIDTH = 240  # [pixels]


def first_pictures(group: Group) -> list[tuple[str, str]]:
    """Return captions and pictures, as addresses that hold all of them; unreadable videos are left out."""
    shown = []
    for episode in group.episodes[:_EPISODES]:
        for key in video_keys(group.info.features):
            picture = _first_frame(group.info, key, episode)
            if picture:
                shown.append(
                    (f"episode {episode.number}, {key.removeprefix('observation.images.')}", picture)
                )
    return shown


def _first_frame(info: DatasetInfo, key: str, episode: Episode) -> str:
    import av
    from av.error import FFmpegError

    chunk, file = (episode.meta.get(f"videos/{key}/{name}") for name in ("chunk_index", "file_index"))
    if not (isinstance(chunk, int) and isinstance(file, int)):
        return ""
    try:
        begin = float(episode.meta.get(f"videos/{key}/from_timestamp") or 0.0)
        with av.open(str(regular(info.root / fill(info.video_path, chunk, file, key)))) as container:
            stream = container.streams.video[0]
            container.seek(int(begin * 1_000_000))
            for frame in container.decode(stream):
                if frame.time is None or frame.time >= begin - 0.5 / episode.fps:
                    return _address(frame)
    except (OSError, FFmpegError, ValueError, TypeError, OverflowError, IndexError):
        return ""
    return ""


def _address(frame: Any) -> str:
    picture = frame.to_image()
    picture.thumbnail((_WIDTH, _WIDTH))
    stream = io.BytesIO()
    picture.save(stream, format="JPEG", quality=80)
    return address(stream.getvalue(), "image/jpeg")
