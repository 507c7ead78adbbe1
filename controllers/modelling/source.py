"""Where a URDF lies, and what a robot that is made of it begins as: all its joints, no shapes yet."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.description import described
from handrail.controllers.robot.model import RobotModel, read_urdf
from handrail.controllers.robot.parts import Arm, Placement
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
        if not (path := Path(urdf).expanduser()).is_file():
            folder = Path.cwd()
        else:
            folder = _mesh_root(path.resolve())
            urdf = str(path.resolve().relative_to(folder))
        place = Placement.of((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        return cls(urdf, folder, Arm(*find_urdf(urdf, folder), "", (), "planar_base", place))

    @property
    def srdf(self) -> Path | None:
        """The SRDF that lies beside it, or in the folder `srdf` beside its folder; None without."""
        file = self.arm.urdf
        places = (file.with_suffix(".srdf"), file.parent.parent / "srdf" / f"{file.stem}.srdf")
        return next((place for place in places if place.is_file()), None)

    def joints(self, frames: Mapping[str, str], more: tuple[str, ...]) -> tuple[list[str], list[str]]:
        """Return joints that move and those that stand still, in pinocchio's order.

        Args:
            frames: of the hands, by name.
            more: joints that move besides those of the hands; those of a head where there are none.
        """
        robot, links = read_urdf(self.arm), self._links()
        for frame in frames.values():
            if frame not in links:
                raise HandrailError(
                    f"--hands {frame}: expected a link of {self.urdf}: one of {', '.join(links)}"
                )
        names = list(robot.names)[1:]
        if missing := sorted(set(more) - set(names)):
            raise HandrailError(f"--joints {missing[0]}: expected one of {', '.join(names)}")
        hands = {joint for frame in frames.values() for joint in chain([self.arm], frame)}
        also = {
            name for name in names if name in more or (not more and any(word in name for word in _LOOKING))
        }
        moving = [name for name in names if name in hands | also]
        if not hands & set(names):
            raise HandrailError(
                f"--hands: expected frames that joints of {self.urdf} move, got {', '.join(frames.values())}"
            )
        return moving, [name for name in names if name not in moving]

    def ends(self) -> list[str]:
        """Return the links that carry no other, which a hand's frame can be."""
        root = check_urdf(self.arm.urdf)
        parents = {parent.get("link") for parent in root.findall("joint/parent")}
        return [link for link in self._links() if link not in parents]

    def _links(self) -> list[str]:
        return [link.get("name", "") for link in check_urdf(self.arm.urdf).findall("link")]


def robot_of(text: str, name: str, folder: Path) -> RobotModel:
    """Return the model of a description that will be a file in a folder."""
    return RobotModel(described(tomllib.loads(text), folder / f"{name}.toml"))


def disabled_pairs(srdf: Path) -> set[frozenset[str]]:
    """Return the pairs of links that an SRDF says not to check."""
    pairs = check_urdf(srdf).findall("disable_collisions")
    return {frozenset((pair.get("link1", ""), pair.get("link2", ""))) for pair in pairs}


def _mesh_root(path: Path) -> Path:
    """Return the nearest folder above a URDF from which its meshes are found."""
    first: HandrailError | None = None
    for folder in path.parents:
        try:
            list(mesh_files(path, folder))
        except HandrailError as error:
            first = first or error
        else:
            return folder
    raise first or HandrailError(f"URDF {path}: expected a folder around it")
