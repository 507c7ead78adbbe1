"""Where a URDF lies, and what a robot that is made of it begins as: all its joints, no shapes yet."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import read_urdf
from handrail.controllers.robot.parts import ZERO, Arm, Placement
from handrail.controllers.robot.urdf import chain, check_urdf, find_urdf, mesh_files

_LOOKING = ("head", "neck")  # in names of joints that move besides those of the hands


@dataclass(frozen=True)
class Source:
    """A URDF: its path as a description says it, and the folder where that has to lie."""

    urdf: str
    folder: Path
    arm: Arm

    @classmethod
    def find(cls, urdf: str) -> "Source":
        """Find a file, or one in an installed package; its meshes are below the description's folder."""
        folder, path = Path.cwd(), Path(urdf).expanduser().resolve()
        if path.is_file():
            folder = _mesh_root(path)
            urdf = str(path.relative_to(folder))
        place = Placement.of(ZERO, ZERO)
        return cls(urdf, folder, Arm(*find_urdf(urdf, folder), "", (), "planar_base", place))

    def joints(self, frames: Mapping[str, str], more: tuple[str, ...]) -> tuple[list[str], list[str]]:
        """Return joints that move and those that stand still, in pinocchio's order.

        Args:
            frames: of the hands, by name.
            more: joints that move besides those of the hands; those of a head where there are none.
        """
        names, links = list(read_urdf(self.arm).names)[1:], self._links()
        if strange := [frame for frame in frames.values() if frame not in links]:
            raise HandrailError(f"--hands {strange[0]}: expected a link of {self.urdf}: {', '.join(links)}")
        if missing := sorted(set(more) - set(names)):
            raise HandrailError(f"--joints {missing[0]}: expected one of {', '.join(names)}")
        hands = {joint for frame in frames.values() for joint in chain([self.arm], frame)} & set(names)
        if not hands:
            raise HandrailError(
                f"--hands: expected frames that joints of {self.urdf} move, got {', '.join(frames.values())}"
            )
        looking = [name for name in names if any(word in name for word in _LOOKING)]
        moving = hands | set(more or looking)
        return [name for name in names if name in moving], [name for name in names if name not in moving]

    def ends(self) -> list[str]:
        """Return the links that carry no other, which a hand's frame can be."""
        parents = {parent.get("link") for parent in check_urdf(self.arm.urdf).findall("joint/parent")}
        return [link for link in self._links() if link not in parents]

    def disabled_pairs(self) -> set[frozenset[str]]:
        """Return the pairs of links that an SRDF says not to check, beside the URDF or in `../srdf`."""
        file = self.arm.urdf
        places = file.with_suffix(".srdf"), file.parent.parent / "srdf" / f"{file.stem}.srdf"
        roots = [check_urdf(place) for place in places if place.is_file()]
        pairs = [pair for root in roots for pair in root.findall("disable_collisions")]
        return {frozenset((pair.get("link1", ""), pair.get("link2", ""))) for pair in pairs}

    def _links(self) -> list[str]:
        return [link.get("name", "") for link in check_urdf(self.arm.urdf).findall("link")]


def _mesh_root(path: Path) -> Path:
    """Return the nearest folder above a URDF from which its meshes are found."""
    errors = []
    for folder in path.parents:
        try:
            list(mesh_files(path, folder))
            return folder
        except HandrailError as error:
            errors.append(error)
    raise errors[0]
