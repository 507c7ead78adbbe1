"""Shared by the tests of `handrail-compare`: datasets of another robot by plain LeRobot, and our own."""

import json
from pathlib import Path

import numpy as np
from datasets_helpers import create, record_with_lerobot
from matplotlib.backends.backend_agg import FigureCanvasAgg

from handrail.datasets.comparison.evaluations import FORMAT, Condition, Policy
from handrail.datasets.comparison.policies import judge_pairs, pair
from handrail.datasets.format.schema import Feature

JOINTS = [f"{name}.pos" for name in ("pan", "lift", "elbow", "flex", "roll", "gripper")]
CAMERA = "observation.images.top"
EPISODES, FRAMES = 6, 24


def lerobot_dataset(root: Path, names: list[str], fps: int, jitter: float, camera: bool) -> Path:
    """Record with plain LeRobot an arm that follows commanded positions one frame later."""
    rng = np.random.default_rng(len(names))
    vector = {"dtype": "float32", "shape": (len(names),), "names": names}
    features = {"observation.state": vector, "action": vector}
    if camera:
        axes = ["height", "width", "channels"]
        features[CAMERA] = {"dtype": "video", "shape": (32, 48, 3), "names": axes}

    def episode(number: int):
        state = np.zeros(len(names), np.float32)
        picture = {CAMERA: np.full((32, 48, 3), 40 * number, np.uint8)} if camera else {}
        for index in range(FRAMES + 3 * number):
            action = np.sin(0.1 * index + np.arange(len(names))) + jitter * rng.normal(size=len(names))
            action = action.astype(np.float32)
            yield {"observation.state": state, "action": action, "task": "wave", **picture}
            state = action

    return record_with_lerobot(root, features, map(episode, range(EPISODES)), fps, "so101")


def handrail_dataset(root: Path, fail_every: int, mode: str, episodes: int = 12, slow: int = 0) -> str:
    """Record with Handrail's writer: seeds are the same in every dataset, lengths are not."""
    names = ("tool.x", "tool.y", "tool.z")
    features = {
        "observation.state": Feature("float32", (3,), names),
        "action": Feature("float32", (2,), ("v_x", "gripper")),
        "teleop.values": Feature("float32", (2,), ("ee.vx", "gripper")),
        "teleop.mode": Feature("string"),
        "controller.smallest_distance": Feature("float32"),
        "safety.contacts": Feature("int64"),
    }
    rng = np.random.default_rng(len(mode))
    with create(root, features=features) as writer:
        for episode in range(episodes):
            count = 30 + episode + slow
            for index in range(count):
                place = np.array([index / count, 0.1 * np.sin(index / 5), 0.0]) + 0.001 * rng.normal(size=3)
                writer.add_frame(
                    {
                        "observation.state": place,
                        "action": np.array([1.0 + 0.1 * rng.normal(), 0.0]),
                        "teleop.values": np.array([rng.normal(), 0.0]),
                        "teleop.mode": mode,
                        "controller.smallest_distance": 0.2 - 0.15 * index / count,
                        "safety.contacts": int(index == 5 and episode == 1),
                    },
                    "go",
                )
            success = (episode + 1) % fail_every != 0
            reason = None if success else "timeout"
            writer.save_episode({"success": success, "failure_reason": reason, "seed": episode, "mode": mode})
    return str(root)


def quick_and_slow(folder: Path) -> list[str]:
    """Record two datasets: one short and always successful, one slow that fails every other time."""
    return [
        handrail_dataset(folder / "quick", 100, "ee"),
        handrail_dataset(folder / "slow", 2, "joints", slow=60),
    ]


def texts(figure):
    """Return the texts of a figure and the boxes that they take; ticks beyond the limits are not drawn."""
    FigureCanvasAgg(figure).draw()
    shown = []
    for axes in figure.axes:
        shown += [axes.title, axes.xaxis.label, axes.yaxis.label, *axes.texts]
        for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            ticks = zip(axis.get_ticklocs(), axis.get_ticklabels(), strict=False)  # shared axes have none
            shown += [label for place, label in ticks if min(low, high) <= place <= max(low, high)]
    return [(text.get_text(), text.get_window_extent()) for text in shown if text.get_text()]


def check_texts(figure) -> None:
    """Check that no text of a figure leaves it or covers another."""
    shown = texts(figure)
    assert shown
    inside = figure.bbox.padded(1.0)
    for place, (text, box) in enumerate(shown):
        assert inside.containsx(box.x0) and inside.containsx(box.x1), text  # noqa: PT018
        assert inside.containsy(box.y0) and inside.containsy(box.y1), text  # noqa: PT018
        others = [other for other, its in shown[place + 1 :] if box.padded(-0.5).overlaps(its)]
        assert not others, (text, others)


def judge(conditions, baseline, rng):
    """Compare the success of all conditions with the baseline's."""
    return judge_pairs(conditions, [pair(label, baseline) for label in conditions if label != baseline], rng)


def condition(label, runs, contacts=False):
    """Return a condition of policies whose rollouts are known; every other scene may have a contact."""
    policies = []
    for run in runs:
        pairs = zip(run.seeds, run.values.tolist(), strict=True)
        rollouts = {seed: {"success": value} for seed, value in pairs}
        for seed in rollouts if contacts else ():
            rollouts[seed]["contacts"] = seed % 2
        policies.append(Policy(run.draw, run.training_seed, {}, rollouts))
    return Condition(label, tuple(policies))


def evaluations(path: Path, seeds: int, **shares) -> str:
    """Write what policies did that succeed in about such shares of 60 scenes; `__` is a space."""
    rng, arms = np.random.default_rng(0), {}
    for label, share in shares.items():
        trained_on = {"episodes": 12, "operator_time": 30.0}
        arms[label.replace("__", " ")] = [
            {
                "training_seed": seed,
                "trained_on": trained_on,
                "rollouts": [{"seed": k, "success": bool(rng.random() < share)} for k in range(60)],
            }
            for seed in range(seeds)
        ]
    path.write_text(json.dumps({"format": FORMAT, "arms": arms}))
    return str(path)
