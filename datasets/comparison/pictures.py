"""The first pictures of a group's first episodes, for a page that needs nothing else."""

import io

from handrail.controllers.regular_file import regular
from handrail.datasets.comparison.groups import Group
from handrail.datasets.format.info_file import fill
from handrail.datasets.format.schema import video_keys
from handrail.datasets.presentation.drawing import address
from handrail.datasets.reading.demonstration import Episode

_SHOWN = 3  # episodes of a group
_WIDTH = 240  # of a picture [pixels]


def first_pictures(group: Group) -> list[tuple[str, str]]:
    """Return captions and pictures, as addresses that hold all of them; unreadable videos are left out."""
    found = {
        f"episode {episode.number}, {key.removeprefix('observation.images.')}": _first_frame(key, episode)
        for episode in group.episodes[:_SHOWN]
        for key in video_keys(group.info.features)
    }
    return [(caption, picture) for caption, picture in found.items() if picture]


def _first_frame(key: str, episode: Episode) -> str:
    import av
    from av.error import FFmpegError

    names = ("chunk_index", "file_index", "from_timestamp")
    chunk, file, begin = (episode.meta.get(f"videos/{key}/{name}") for name in names)
    if not (isinstance(chunk, int) and isinstance(file, int)):
        return ""
    try:
        begin, path = float(begin or 0.0), episode.info.root / fill(episode.info.video_path, chunk, file, key)
        with av.open(str(regular(path))) as container:
            container.seek(int(begin * 1_000_000))
            for frame in container.decode(container.streams.video[0]):
                if frame.time is None or frame.time >= begin - 0.5 / episode.fps:
                    picture, stream = frame.to_image(), io.BytesIO()
                    picture.thumbnail((_WIDTH, _WIDTH))
                    picture.save(stream, format="JPEG", quality=80)
                    return address(stream.getvalue(), "image/jpeg")
    except (OSError, FFmpegError, ValueError, TypeError, OverflowError, IndexError):
        return ""
    return ""
