"""A robot's floor, the size of its world, and the places of its cameras."""

from typing import Any

import numpy as np

from handrail.controllers.modelling.clouds import LinkCloud
from handrail.controllers.modelling.home import shoulder_place
from handrail.controllers.robot.model import RobotModel

_LARGE = 0.6  # reach of a hand whose world has scale 1 [m]
_WIDE = 0.3  # width of a base of the URDF's own, as a share of the reach
_HEAVY = 120.0  # mass of a base at scale 1 [kg]
_SHOULDER, _DECK, _CHASSIS, _AHEAD = 0.75, 0.28, (0.8, 0.6), 0.2  # of a base that is added, at scale 1 [m]
_PAINT = [0.2, 0.22, 0.25]  # of such a base
_MAST, _SEEN = np.array([-0.35, 0.0, 1.75]), np.array([1.0, 0.0, 0.7])  # of the front camera, at scale 1 [m]


def standing(tables: dict[str, Any], model: RobotModel, clouds: list[LinkCloud], reach: float) -> list[str]:
    """Write base, mount and world into the tables; return guesses.

    Args:
        tables: of the description; the arm is at the origin.
        model: of these.
        clouds: of the links.
        reach: of a hand from its shoulder [m].
    """
    base, place = tables["base"], tables["arm"][0]["translation"]
    fixed, joints = base["kind"] == "fixed", len(model.description.base.joints)
    still = [cloud.triangles.reshape(-1, 3) for cloud in clouds if cloud.joint <= joints]
    points = np.vstack([*still, np.zeros((1, 3))])
    lower, size = points.min(axis=0), np.ptp(points, axis=0)
    scale = round(min(reach / 1.2, 1.0), 2) if reach < _LARGE or fixed else 1.0
    second = float(shoulder_place(model, 0, model.description.home)[2])
    base |= {"mass": _HEAVY * scale**3, "height": 0.04, "size": np.maximum(size, 0.1)[:2]}
    if min(size[:2]) >= _WIDE * reach:
        place[2], base["height"] = -float(lower[2]), min(float(size[2]), 0.3)
        said = "base: the URDF's own, {:.2f} × {:.2f} m".format(*base["size"])
    elif fixed:
        place[2], said = base["height"], "base: a plate of 4 cm on the floor"
    else:
        chassis, width = np.array([*_CHASSIS, _DECK]) * scale, max(0.8 * float(max(size[:2])), 0.05)
        base |= {"size": chassis[:2], "height": chassis[2]}
        place[0], place[2] = _AHEAD * scale, max(_SHOULDER * scale - second, chassis[2])
        rise = max(place[2] - chassis[2] - 0.01, 0.02)
        column = [place[0], 0.0, chassis[2] + rise / 2]
        added = {"chassis": (chassis, chassis * [0.0, 0.0, 0.5]), "column": ([width, width, rise], column)}
        on = {"frame": "planar_base"}
        seen = [{"name": name} | on | {"box": box, "at": at} for name, (box, at) in added.items()]
        tables["collision"] += seen
        tables["visual"] = [{"rgba": _PAINT} | shape for shape in seen]
        said = f"base: added, with chassis and column, the arm {place[2]:.2f} m above the floor"
    goals, high = np.array([0.7, 1.0]) * scale, second + place[2]
    if abs(high - goals.mean()) > 0.5 * reach:
        goals = np.maximum([high - 0.4 * reach, high], 0.1 * reach)
    cube, deck = 0.05 * min(1.0, 2.0 * scale), np.array([0.55, 0.65]) * scale
    tables["world"] = {"scale": scale, "tables": deck, "goals": goals, "cube": cube}
    low, top = goals
    return [said, f"world: scale {scale} for a reach of {reach:.2f} m, goals {low:.2f} to {top:.2f} m high"]


def cameras(model: RobotModel) -> list[dict[str, Any]]:
    """Return one on a mast, and one beside each hand, its horizon level at home."""
    home, scale, found = model.description.home, model.description.world.scale, []
    if model.description.base.joints:
        top = max(float(model.pose(home, placed.frame).position[2]) for placed in model.description.collision)
        mast = np.maximum(_MAST * scale, [-9.0, 0.0, top + 0.4 * scale])
        found.append({"name": "front", "frame": "planar_base", "position": mast, "looks_at": _SEEN * scale})
    for hand in model.description.hands:
        tool, ahead = hand.placement.translation, hand.placement.rotation[:, 2]
        above = model.pose(home, hand.frame).rotation.T @ [0.0, 0.0, 1.0]
        ways = [way - ahead * (ahead @ way) for way in (above, hand.placement.rotation[:, 0])]
        aside = ways[int(np.linalg.norm(ways[0]) < 1e-3)]  # of a hand that points up or down, its x axis
        position = tool + scale * (0.12 * aside / np.linalg.norm(aside) - 0.17 * ahead)
        view = {"position": position, "looks_at": tool + scale * 0.05 * ahead, "up": above, "fovy": 85.0}
        found.append({"name": hand.named("wrist").replace(".", "_"), "frame": hand.frame} | view)
    return found
