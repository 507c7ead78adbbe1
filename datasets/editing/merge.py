"""What several datasets have in common, so that their episodes fit into one."""

from collections.abc import Sequence

import pyarrow as pa

from handrail.controllers.errors import HandrailError
from handrail.datasets.editing.source import EditSource
from handrail.datasets.format.info_file import Encodings
from handrail.datasets.format.metadata import ColumnTypes

_NEEDED = ("video.codec", "video.pix_fmt")  # in which all videos of a camera have to agree


def check_alike(first: EditSource, other: EditSource) -> None:
    """Check that frames of one dataset fit into another."""
    names = str(other.layout.root), str(first.layout.root)
    other.manifest.check_fits(first.manifest, f"merge: cannot add {names[0]!r} to {names[1]!r}")


def merged_types(sources: Sequence[EditSource]) -> ColumnTypes:
    """Return the extra columns that any of them has."""
    found: ColumnTypes = {}
    for source in sources:
        for name, kind in source.types.items():
            before = found.setdefault(name, kind)
            if before != kind and {before, kind} == {pa.int64(), pa.float64()}:
                found[name] = pa.float64()
            elif before != kind:
                names = [source.layout.root, sources[0].layout.root]
                raise _unlike(names, f"episode column {name!r}", kind, before)
    return found


def merged_encodings(sources: Sequence[EditSource]) -> Encodings:
    """Return how all videos are encoded: what they agree in; nothing where Handrail alone encoded them."""
    found = {key: dict(encoding) for key, encoding in sources[0].encodings.items()}
    for source in sources[1:]:
        for key, encoding in source.encodings.items():
            mine = found.setdefault(key, dict(encoding))
            for name in _NEEDED:
                if mine.get(name) != encoding.get(name):
                    names = [source.layout.root, sources[0].layout.root]
                    raise _unlike(names, f"{name} of {key!r}", encoding.get(name), mine.get(name))
            found[key] = {name: value for name, value in mine.items() if encoding.get(name) == value}
    return found


def _unlike(names: Sequence[object], thing: str, theirs: object, mine: object) -> HandrailError:
    return HandrailError(
        f"merge: cannot add {str(names[0])!r} to {str(names[1])!r}: its {thing} is {theirs}, expected {mine}"
    )
