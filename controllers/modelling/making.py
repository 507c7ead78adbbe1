"""A robot's description from its URDF: everything that it says, and what of that is a guess."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin

from handrail.controllers.modelling.clouds import LinkCloud, hull, link_clouds
from handrail.controllers.modelling.fitting import fitted, pieces, shared
from handrail.controllers.modelling.hands import HandFinder, pointing
from handrail.controllers.modelling.home import find_home, reach_of
from handrail.controllers.modelling.limits import arm_limits, base_limits
from handrail.controllers.modelling.pairs import Meetings, configurations, meetings
from handrail.controllers.modelling.source import Source, disabled_pairs, robot_of
from handrail.controllers.modelling.standing import PLACEHOLDER, cameras, standing
from handrail.controllers.modelling.toml_text import toml_text
from handrail.controllers.robot.model import RobotModel

_SAMPLES = 3000
_PIECE = 1e-3  # least volume that cutting a shape saves, at scale 1 [m³]
_NEAR = 0.02  # of links that can meet [m]
_OFTEN = 0.01  # share of postures in which shapes overlap, in none of which their links meet: they never do
_NARROW = 0.12  # distance that a pair of shapes seldom exceeds, which keeps a smaller margin [m]
_START = -1.5  # of the base along x, at scale 1 [m]
_LIMITS = ("position_lower", "position_upper", "velocity", "acceleration", "effort", "servo")


@dataclass(frozen=True)
class Made:
    """A description's tables, its robot, and a line for each guess that a person should look at."""

    tables: dict[str, Any]
    model: RobotModel
    guesses: list[str]


class RobotMaker:
    """Makes a robot of a URDF, step by step; each adds to the tables, and its guesses.

    Args:
        source: the URDF.
        name: of the robot.
        hands: frame of each hand, by its name; the only one has none.
        base: planar or fixed.
        joints: that move besides those of the hands; those of a head where there are none.
    """

    def __init__(
        self, source: Source, name: str, hands: Mapping[str, str], base: str, joints: tuple[str, ...] = ()
    ) -> None:
        self._source, self._hands, self._rng = source, hands, np.random.default_rng(0)
        moving, still = source.joints(hands, joints)
        self._finder, n = HandFinder(source.arm, moving), len(moving) + (3 if base == "planar" else 0)
        self._tables: dict[str, Any] = {
            "name": name,
            "base": {"kind": base, "mass": 1.0, "height": 0.1, "size": [0.5, 0.5]},
            "arm": [{"urdf": source.urdf, "translation": [0.0, 0.0, 0.0], "joints": moving}],
            "hand": [({"name": word} if word else {}) | {"frame": frame} for word, frame in hands.items()],
            "home": {"q": np.zeros(n)},
            "limits": {name: np.full(n, -1e3 if name == "position_lower" else 1e3) for name in _LIMITS},
            "camera": [],
            "collision": [PLACEHOLDER],
            "self_collision": {"pairs": []},
        }
        fingers = {joint for frame in hands.values() for joint in self._finder.finger_joints(frame)}
        still = [joint for joint in still if joint not in fingers]
        self._guesses = [f"joints that stand still: {', '.join(still)}; --joints moves them"] if still else []

    def make(self) -> Made:
        """Take all steps."""
        self._set_limits()
        for hand in self._tables["hand"]:
            self._set_hand(hand)
        self._fit_shapes(self._stand())
        self._find_home()
        return Made(self._tables, self._model(), self._guesses)

    def _model(self) -> RobotModel:
        return robot_of(toml_text(self._tables), self._tables["name"], self._source.folder)

    def _set_limits(self) -> None:
        """Take the URDF's limits; the hands' reach, which all sizes come from, hangs on them."""
        model = self._model()
        limits, guesses = arm_limits(model, self._source.arm, self._rng)
        self._guesses += guesses
        for name, values in limits.items():
            self._tables["limits"][name][model.size - len(values) :] = values
        ends = self._tables["limits"]["position_lower"], self._tables["limits"]["position_upper"]
        self._tables["home"]["q"] = np.clip(0.0, *ends)
        model = self._model()
        self._reach = min(reach_of(model, number, self._rng) for number in range(len(self._hands)))

    def _set_hand(self, hand: dict[str, Any]) -> None:
        """Find which way a hand points, and its fingers."""
        frame = hand["frame"]
        axes = self._finder.axes(frame)
        found = self._finder.gripper(frame, axes)
        words = f"hand {hand.get('name', '')}".strip() + f": points along {pointing(axes)} of {frame}; "
        if found is None:
            hand["rpy"] = pin.rpy.matrixToRpy(axes)
            self._guesses.append(words + "no gripper, for it has not two fingers that move")
            return
        fingers = f"{hand['name']}_fingers" if "name" in hand else "fingers"
        hand |= {"translation": found.pad, "rpy": found.rpy, "gripper": found.entries(frame, fingers)}
        self._tables["collision"].append({"name": fingers, "frame": frame, "tool": True} | found.box)
        self._guesses.append(words + f"two fingers that slide, {1e3 * found.stroke:.0f} mm apart when open")

    def _stand(self) -> list[LinkCloud]:
        """Put the robot on the floor; return what its links fill."""
        model = self._model()
        clouds, still = link_clouds(model), len(model.description.base.joints)
        self._guesses += standing(self._tables, model, clouds, self._reach)
        if still:
            base_limits(self._tables, model)
        up = np.array(self._tables["arm"][0]["translation"])
        return [replace(c, triangles=c.triangles + up) if c.joint <= still else c for c in clouds]

    def _fit_shapes(self, clouds: list[LinkCloud]) -> None:
        """Fit shapes to the links, body by body, and find the pairs that can meet."""
        model, shapes = self._model(), self._tables["collision"]
        gripping = [hand["frame"] for hand in self._tables["hand"] if "gripper" in hand]
        fingers = {link for frame in gripping for link in self._finder.finger_links(frame)}
        at = {
            model.pinocchio.frames[model.frame_id(frame)].parentJoint: frame for frame in self._hands.values()
        }
        least = _PIECE * self._tables["world"]["scale"] ** 3
        for joint in sorted({cloud.joint for cloud in clouds}):
            for link, triangles in shared([c for c in clouds if c.joint == joint and c.link not in fingers]):
                frame = at.get(joint, link)
                place = model.pinocchio.frames[model.frame_id(frame)].placement
                for number, piece in enumerate(pieces(triangles, least), 1):
                    points = (hull(piece.reshape(-1, 3)) - place.translation) @ place.rotation
                    name = f"{link}_{number}" if number > 1 else link
                    shapes.append({"name": name, "frame": frame} | fitted(points))
        shapes.remove(PLACEHOLDER)
        model = self._model()
        self._choose_pairs(meetings(model, clouds, configurations(model, _SAMPLES, self._rng), _NEAR))

    def _choose_pairs(self, met: Meetings) -> None:
        """List pairs that can meet; those that never do, always do, or that an SRDF leaves out are not."""
        always, pairs, doubted, srdf = met.always, [], [], self._source.srdf
        disabled = disabled_pairs(srdf) if srdf else set()
        for pair, nearest, column in zip(met.pairs, met.nearest, met.distances[: met.drawn].T, strict=True):
            seldom = (column < 0.0).mean() <= _OFTEN and frozenset(pair) not in disabled
            if nearest >= (_NEAR if seldom else 0.0) or pair in always:
                continue
            doubted += [pair] if frozenset(pair) in disabled else []
            narrow = np.quantile(column, 0.9) < _NARROW * self._tables["world"]["scale"]
            pairs.append([*pair, *([max(0.0, float(np.median(column)) / 2)] if narrow else [])])
        self._tables["self_collision"]["pairs"] = pairs
        for words, named in (
            (_ALWAYS, always),
            (f"pairs kept, though {srdf.name if srdf else 'no SRDF'} leaves them out", doubted),
        ):
            if named:
                self._guesses.append(f"{words}: {', '.join(' – '.join(pair) for pair in named)}")

    def _find_home(self) -> None:
        """Choose where it begins, and cameras for there."""
        model = self._model()
        home = find_home(model, self._reach, self._rng)
        if model.description.base.joints:
            home[:3] = [_START * self._tables["world"]["scale"], 0.0, 0.0]
        self._tables["home"]["q"] = home
        self._tables["camera"] = cameras(self._model())
        places = ", ".join(f"{name} {value:.2f}" for name, value in zip(model.joints, home, strict=True))
        self._guesses += [f"home: {places}", "cameras: on a mast, and beside each hand"]


_ALWAYS = "pairs left out, which touch in most postures"
