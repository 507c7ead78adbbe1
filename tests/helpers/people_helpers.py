"""Folders of user studies whose numbers are known, and datasets of scripted operators beside them."""

import json
from pathlib import Path

import numpy as np
from datasets_helpers import create

from handrail.datasets.format.schema import Feature

FPS = 30
NAMES = ("tool.x", "tool.y", "tool.z")
FEATURES = {
    "observation.state": Feature("float32", (3,), NAMES),
    "action": Feature("float32", (2,), ("v_x", "gripper")),
    "teleop.raw": Feature("float32", (2,), ("ee.vx", "ee.vy")),
    "teleop.mask": Feature("bool", (3,)),
    "teleop.mode": Feature("string"),
    "teleop.device": Feature("string"),
    "teleop.age": Feature("float32"),
    "teleop.round_trip": Feature("float32"),
    "teleop.undos": Feature("int64"),
    "controller.smallest_distance": Feature("float32"),
    "safety.contacts": Feature("int64"),
}


def frame(mode, index, device, undos=0):
    """Return a frame of a person who pushes to and fro, or of a script."""
    return {
        "observation.state": np.array([0.01 * index, 0.0, 0.0]),
        "action": np.array([0.3, 0.0]),
        "teleop.raw": np.array([np.sign(np.sin(0.5 * index)), 0.0]),
        "teleop.mask": np.array([True, False, True]),
        "teleop.mode": mode,
        "teleop.device": device,
        "teleop.age": 0.01 * (index % 5) if device else 0.0,
        "teleop.round_trip": 0.02 if device else 0.0,
        "teleop.undos": undos,
        "controller.smallest_distance": 0.2,
        "safety.contacts": 0,
    }


def dataset(root, task, mode, episodes, operator="browser"):
    """Record episodes of (participant, scene, frames, success)."""
    device = "keyboard" if operator == "browser" else ""
    with create(root, features=FEATURES) as writer:
        for participant, scene, frames, success in episodes:
            for index in range(frames):
                writer.add_frame(frame(mode, index, device, undos=int(index > 5) if device else 0), "go")
            meta = {"success": success, "seed": scene, "operator": operator, "mode": mode}
            writer.save_episode(meta | {"environment": task, "participant": participant})
    return Path(root)


def study(root, data, scores=(), demo=False, source=False):
    """Make a study's folder: `data` has episodes by (task, mode), `scores` rows of scores.csv."""
    root.mkdir(parents=True)
    (root / "study.json").write_text(json.dumps({"demo": demo, "study": {}}))
    for (task, mode), episodes in data.items():
        dataset(root / "data" / task / mode, task, mode, episodes)
    if scores:
        write_scores(root, ["participant,condition,score,value", *scores])
    return root


def write_scores(root, lines):
    """Write scores.csv, line by line."""
    (root / "exports").mkdir(exist_ok=True)
    (root / "exports" / "scores.csv").write_text("\n".join(lines) + "\n")


def people(count, frames, success=True, scene=7):
    """Return one episode each of participants P1, P2, …; `frames` says how long, by number from 0."""
    return [(f"P{place + 1}", scene, frames(place), success) for place in range(count)]
