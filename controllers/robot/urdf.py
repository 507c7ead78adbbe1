"""A URDF before pinocchio reads it: of sane size, every number finite, every mesh in its folder."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

from handrail.controllers.errors import HandrailError, message_of
from handrail.controllers.regular_file import is_inside, open_regular, regular

_MOST_BYTES = 16 * 2**20
_MOST = 1000  # links, and joints: a chain of many more overflows the reader's stack
_LARGEST, _SMALLEST = 1e30, 1e-100  # of a number, 0 apart
_NUMBERS = {
    *("xyz", "rpy", "lower", "upper", "velocity", "effort", "radius", "length", "size", "scale", "value"),
    *("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
}
_INSIDE = ("package://", "model://")


def check_urdf(urdf: Path) -> ET.Element:
    """Return the root of a URDF that pinocchio can read."""
    root = _parsed(urdf)
    for kind in ("link", "joint"):
        if (count := len(root.findall(kind))) > _MOST:
            raise HandrailError(f"URDF {urdf}: expected at most {_MOST} elements {kind!r}, got {count}")
    for element in root.iter():
        for name in sorted(_NUMBERS & element.attrib.keys()):
            for word in element.attrib[name].split():
                if not _is_sane(word):
                    what = f"URDF {urdf}: {element.tag} {name}"
                    raise HandrailError(f"{what}: expected a finite number of sane size, got {word!r:.40}")
    return root


def mesh_files(urdf: Path, folder: Path) -> Iterator[Path]:
    """Yield the files of the meshes that a URDF names.

    Args:
        urdf: its file.
        folder: that `package://` paths start from.
    """
    names = [mesh.get("filename", "") for mesh in check_urdf(urdf).iter("mesh")]
    for name in dict.fromkeys(names):
        scheme = next((each for each in _INSIDE if name.startswith(each)), "")
        place = folder / name.removeprefix(scheme)
        if not scheme or not is_inside(place, folder):
            raise HandrailError(
                f"URDF {urdf}: mesh {name!r:.80}: expected package://PATH, a file in {folder}"
            )
        try:
            yield regular(place)
        except OSError as error:
            raise HandrailError(f"URDF {urdf}: mesh {name!r:.80}: {message_of(error)}") from error


def _parsed(urdf: Path) -> ET.Element:
    try:
        with open_regular(urdf) as file:
            data = file.read(_MOST_BYTES + 1)
        if len(data) > _MOST_BYTES or b"<!DOCTYPE" in data:
            raise ValueError(f"expected at most {_MOST_BYTES >> 20} MB of XML, and no DOCTYPE")
        return ET.fromstring(data)
    except (OSError, ValueError, ET.ParseError, RecursionError) as error:
        raise HandrailError(f"URDF {urdf}: {message_of(error)}") from error


def _is_sane(word: str) -> bool:
    try:
        size = abs(float(word))
    except ValueError:
        return True  # no number: pinocchio says what it expects
    return math.isfinite(size) and (size == 0.0 or _SMALLEST < size < _LARGEST)
