"""A URDF before pinocchio reads it: of sane size, every number finite, every mesh in its folder."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from functools import cache
from importlib import metadata
from pathlib import Path, PurePosixPath

from handrail.controllers.errors import HandrailError, restated
from handrail.controllers.regular_file import is_inside, read_regular, regular
from handrail.controllers.robot.parts import Arm

_MOST_BYTES = 16 * 2**20
_MOST = 1000  # links, and joints: a chain of many more overflows the reader's stack
_LARGEST, _SMALLEST = 1e30, 1e-100  # of a number, 0 apart
_NUMBERS = {
    *("xyz", "rpy", "lower", "upper", "velocity", "effort", "radius", "length", "size", "scale", "value"),
    *("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
}
_NAMES = {"link": ("name",), "joint": ("name",), "parent": ("link",), "child": ("link",), "mimic": ("joint",)}
_TWICE = 4.0 * math.pi  # [rad]
_files_of = cache(metadata.files)  # a thousand paths are looked for
_INSIDE = ("package://", "model://")


def find_urdf(urdf: str, folder: Path) -> tuple[Path, Path]:
    """Return the URDF and the folder that its `package://` paths start from."""
    name = PurePosixPath(urdf)
    beside = folder / name
    if not name.parts or name.is_absolute() or ".." in name.parts or not is_inside(beside, folder):
        raise HandrailError(f"URDF {urdf}: expected a path inside a package, or beside the description")
    if beside.is_file():
        return beside, folder
    distribution = name.parts[0]
    try:
        files = _files_of(distribution) or []
    except metadata.PackageNotFoundError:
        files = []
    for file in files:
        if PurePosixPath(file).parts[-len(name.parts) :] == name.parts:
            path = Path(str(file.locate())).resolve()
            return path, path.parents[len(name.parts) - 1]
    raise HandrailError(
        f"URDF {urdf}: expected it beside the description or in an installed package {distribution}, "
        "found it in neither"
    )


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


def urdf_text(arm: Arm) -> str:
    """Return an arm's URDF with its prefix; joints without limits turn twice around both ways."""
    root = check_urdf(arm.urdf)
    for joint in root.findall("joint"):
        if joint.get("type") == "continuous":
            joint.set("type", "revolute")
            limit = joint.find("limit")
            limit = ET.SubElement(joint, "limit", effort="0", velocity="0") if limit is None else limit
            limit.attrib |= {"lower": str(-_TWICE), "upper": str(_TWICE)}
    if arm.prefix:
        for element in root.iter():
            for name in _NAMES.get(element.tag, ()):
                if name in element.attrib:
                    element.set(name, arm.prefix + element.attrib[name])
    return ET.tostring(root, "unicode")


def chain(arms: Sequence[Arm], frame: str) -> Iterator[str]:
    """Yield the joints that move a frame, from it to the base, prefixes included."""
    before: dict[str, tuple[str, str]] = {}
    for arm in arms:
        root = ET.fromstring(urdf_text(arm))
        parts = [(joint, joint.find("parent"), joint.find("child")) for joint in root.findall("joint")]
        found = {
            c.get("link", ""): (j.get("name", ""), p.get("link", ""))
            for j, p, c in parts
            if p is not None and c is not None
        }
        links = {link.get("name", "") for link in root.findall("link")}
        before |= dict.fromkeys(links - found.keys(), ("", arm.on)) | found
    while frame in before:
        joint, frame = before.pop(frame)
        if joint:
            yield joint


def followers(arm: Arm) -> list[tuple[str, str]]:
    """Return the joints that follow another one (`mimic`), and which, prefixes included."""
    joints = ET.fromstring(urdf_text(arm)).findall("joint")
    return [(each.get("name", ""), mimic.get("joint", "")) for each in joints for mimic in each.iter("mimic")]


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
            raise HandrailError(f"URDF {urdf}: mesh {name!r:.80}: expected package://PATH, file in {folder}")
        with restated(f"URDF {urdf}: mesh {name!r:.80}", OSError):
            yield regular(place)


def _parsed(urdf: Path) -> ET.Element:
    with restated(f"URDF {urdf}", (OSError, ValueError, ET.ParseError, RecursionError)):
        data = read_regular(urdf, _MOST_BYTES)
        if b"<!DOCTYPE" in data:
            raise ValueError("expected XML, and no DOCTYPE")
        return ET.fromstring(data)


def _is_sane(word: str) -> bool:
    try:
        size = abs(float(word))
    except ValueError:
        return True  # no number: pinocchio says what it expects
    return math.isfinite(size) and (size == 0.0 or _SMALLEST < size < _LARGEST)
