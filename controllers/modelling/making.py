"""A robot's description from its URDF: everything that it says, and what of that is a guess."""

import itertools
import tomllib
from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import FloatArray
from handrail.controllers.modelling.clouds import LinkCloud, body_frame, hull, link_clouds
from handrail.controllers.modelling.fitting import fitted, pieces
from handrail.controllers.modelling.hands import SHARES, HandFinder
from handrail.controllers.modelling.home import find_home, reach_of
from handrail.controllers.modelling.limits import LIMITS, arm_limits, base_limits
from handrail.controllers.modelling.pairs import Meetings
from handrail.controllers.modelling.source import Source
from handrail.controllers.modelling.standing import cameras, standing
from handrail.controllers.modelling.toml_text import toml_text
from handrail.controllers.robot.description import described
from handrail.controllers.robot.model import RobotModel

_SAMPLES = 2000
_CUTS = 2  # of a body's shape, one after the other
_ROUNDS = 2  # before the second one, shapes that are too fat are halved
_CUT = 0.88  # share of a box's volume that two may have which take its place
_PIECE = 1e-3  # least volume that cutting a shape saves, at scale 1 [m³]
_NEAR = 0.02  # of shapes that can meet [m]
_OFTEN = 0.01  # share of postures in which shapes overlap: then meshes say whether they meet
_FAT = 0.3  # share of postures in which shapes overlap, and the meshes in them do not touch
_NARROW = 0.12  # distance that a pair of shapes seldom exceeds, which keeps a smaller margin [m]
_START = -1.5  # of the base along x, at scale 1 [m]
_PLACEHOLDER = {"name": "none", "frame": "planar_base", "sphere": 0.1}  # before there are shapes


class RobotMaker:
    """Makes a robot of a URDF, step by step; each adds to the tables, and its guesses.

    Args:
        source: the URDF.
        name: of the robot.
        hands: frame of each hand, by its name; the only one has none.
        base: planar or fixed.
        joints: that move besides those of the hands; those of a head where there are none.

    Attributes:
        tables: of the description.
        guesses: a line for each that a person should look at.
    """

    def __init__(
        self, source: Source, name: str, hands: Mapping[str, str], base: str, joints: tuple[str, ...] = ()
    ) -> None:
        self._source, self._file = source, source.folder / f"{name}.toml"
        moving, still = source.joints(hands, joints)
        self._finder, n = HandFinder(source.arm, moving), len(moving) + (3 if base == "planar" else 0)
        self._hands = [({"name": word} if word else {}) | {"frame": frame} for word, frame in hands.items()]
        self.tables: dict[str, Any] = {
            "name": name,
            "base": {"kind": base, "mass": 1.0, "height": 0.1, "size": [0.5, 0.5]},
            "arm": [{"urdf": source.urdf, "translation": [0.0, 0.0, 0.0], "joints": moving}],
            "hand": self._hands,
            "home": {"q": np.zeros(n)},
            "limits": {name: np.full(n, -1e3 if name == "position_lower" else 1e3) for name in LIMITS},
            "camera": [],
            "collision": [_PLACEHOLDER],
            "self_collision": {"pairs": []},
        }
        fingers = {j for frame in hands.values() for each in self._finder.fingers(frame) for j in each}
        still = [joint for joint in still if self._finder.model.getJointId(joint) not in fingers]
        self.guesses = [f"joints that stand still: {', '.join(still)}; --joints moves them"] if still else []

    def make(self) -> "RobotMaker":
        """Take all steps: limits, reach, hands, what it stands on, shapes, home, cameras."""
        tables, rng = self.tables, np.random.default_rng(0)
        self.guesses += arm_limits(tables, self.model(), rng)
        tables["home"]["q"] = np.clip(0.0, *(tables["limits"][name] for name in LIMITS[:2]))
        reach = reach_of(self.model(), rng)
        for hand in self._hands:
            self._set_hand(hand)
        model = self.model()
        self.guesses += standing(tables, model, link_clouds(model), reach)
        base_limits(tables, self.model())
        self._fit_shapes(self.model())
        model = self.model()
        home = find_home(model, reach, rng)
        base = len(model.description.base.joints)
        home[:base] = np.array([_START * tables["world"]["scale"], 0.0, 0.0])[:base]
        tables["home"]["q"] = home
        tables["camera"] = cameras(self.model())
        places = ", ".join(f"{name} {value:.2f}" for name, value in zip(model.joints, home, strict=True))
        self.guesses += [f"home: {places}", "cameras: on a mast, and beside each hand"]
        return self

    def model(self) -> RobotModel:
        """Return the robot as far as it is made."""
        return RobotModel(described(tomllib.loads(toml_text(self.tables)), self._file))

    def _set_hand(self, hand: dict[str, Any]) -> None:
        """Find which way a hand points, and its fingers."""
        frame, name = hand["frame"], hand.get("name", "")
        axes = self._finder.axes(frame)
        ahead = int(np.argmax(np.abs(axes[:, 2])))
        way, fingers = "+−"[int(axes[ahead, 2] < 0.0)] + "xyz"[ahead], f"{name}_fingers".lstrip("_")
        said = "no gripper, for it has not two fingers that move apart"
        hand["rpy"] = pin.rpy.matrixToRpy(axes)
        if found := self._finder.gripper(frame, axes):
            hand |= found[0]
            hand["gripper"]["shape"] = fingers
            self.tables["collision"].append({"name": fingers, "frame": frame, "tool": True} | found[1])
            said = f"two fingers that slide, {1e3 * hand['gripper']['stroke']:.0f} mm apart when open"
        self.guesses.append(f"hand {name}".strip() + f": points along {way} of {frame}; {said}")

    def _fit_shapes(self, model: RobotModel) -> None:
        """Fit shapes to each body's links, and halve those that are too fat; find the pairs that can meet."""
        given = [shape for shape in self.tables["collision"] if shape is not _PLACEHOLDER]
        hands, least = [hand["frame"] for hand in self._hands], _PIECE * model.description.world.scale**3
        gripping = [hand["frame"] for hand in self._hands if "gripper" in hand]
        fingers = [link for frame in gripping for link in self._fingers(model, frame)]
        held = {link.link for link in fingers}
        clouds = [cloud for cloud in link_clouds(model) if cloud.link not in held]
        parts: dict[str, tuple[str, FloatArray]] = {}
        link_of: dict[str, str] = {}  # of each frame that shapes are on
        taken, links = {*(shape["name"] for shape in given), "floor"}, {cloud.link for cloud in clouds}

        def cut(name: str, frame: str, pieces: list[FloatArray]) -> None:
            """Let parts of a body have its name, and others like it that nothing else has."""
            others = taken | (links | parts.keys()) - {name}
            names = (f"{name}_{number}" if number > 1 else name for number in itertools.count(1))
            free = (each for each in names if each not in others)
            parts.update({next(free): (frame, piece) for piece in pieces})

        for joint in sorted({cloud.joint for cloud in clouds}):
            body = [cloud for cloud in clouds if cloud.joint == joint]
            link = max(body, key=lambda cloud: np.prod(np.ptp(cloud.triangles, axis=(0, 1)))).link
            own = [frame for frame in hands if body_frame(model.pinocchio, frame).parentJoint == joint]
            every = np.vstack([cloud.triangles for cloud in body])
            link_of[(own or [link])[0]] = link
            cut(link, (own or [link])[0], pieces(every, _CUTS, _CUT, least))
        for _ in range(_ROUNDS):
            shapes = [_shape(model, name, *part) for name, part in parts.items()]
            self.tables["collision"] = given + shapes
            met = Meetings(self.model(), [*clouds, *fingers], _SAMPLES)
            if not (fat := self._choose_pairs(met, link_of)):
                break
            for name in sorted(fat & parts.keys()):
                cut(name, parts[name][0], pieces(parts[name][1], 1, np.inf, -np.inf))
        inside = [pair for pair, joints in zip(met.pairs, met.joints, strict=True) if joints in met.nested]
        if words := ", ".join(" – ".join(pair) for pair in inside):
            self.guesses.append(f"pairs left out, for their bodies are built into each other: {words}")
        if words := ", ".join(f"{' – '.join(pair)} ({share:.0%})" for pair, share in met.beside.items()):
            self.guesses.append(f"neighbours that can touch, and nothing keeps them apart: {words}")

    def _fingers(self, model: RobotModel, frame: str) -> list[LinkCloud]:
        """Return what the fingers of a hand fill, open and closed."""
        on = body_frame(model.pinocchio, frame)
        both = [each for share in SHARES for each in self._finder.finger_clouds(frame, share)]
        return [link.moved(on.parentJoint, on.placement) for each in both for link in each]

    def _choose_pairs(self, met: Meetings, link_of: dict[str, str]) -> set[str]:
        """List pairs that can meet; return the shapes of them that are too fat."""
        disabled, fat, pairs = self._source.disabled_pairs(), set(), []
        links = {each["name"]: link_of.get(each["frame"], each["frame"]) for each in self.tables["collision"]}
        for index in np.flatnonzero(met.distances.min(axis=0) < _NEAR):
            pair, overlap, column = met.pairs[index], met.overlap[index], met.distances[:, index]
            doubted = overlap > _OFTEN or frozenset(map(links.get, pair)) in disabled
            touch = met.share(index) if doubted else 1.0
            if touch > 0.0 and met.joints[index] not in met.nested:
                narrow = np.quantile(column, 0.9) < _NARROW * self.tables["world"]["scale"]
                pairs.append([*pair, *([max(0.0, float(np.median(column)) / 2)] if narrow else [])])
                fat |= set(pair) if overlap - touch > _FAT else set()
        self.tables["self_collision"]["pairs"] = pairs
        return fat


def _shape(model: RobotModel, name: str, frame: str, triangles: FloatArray) -> dict[str, Any]:
    """Return a shape around triangles of a body, (m, 3, 3), on a frame."""
    place = body_frame(model.pinocchio, frame).placement
    points = (hull(triangles.reshape(-1, 3)) - place.translation) @ place.rotation
    return {"name": name, "frame": frame} | fitted(points)
