"""A dataset of a stranger: words that steer terminals, or are markup, formulas or lines of their own."""

import json

import numpy as np
from datasets_helpers import FPS, REPO

from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import Feature
from handrail.datasets.recording.writer import EpisodeWriter

PLAIN, FORGED = "plain", "saved: all is well"
STEERING = "\x1b[2J\x1b]0;pwned\x07\x9b1A\x08\x7f\u202egnp\u2066\u200b\u2028"
LIVE = (
    "<script>alert(1)</script>",
    "![x](http://evil.example/p.png)[y](javascript:alert(1))<http://evil.example>",
    f"a | b\n# heading\n\n{FORGED}\r\n---\n- item\n```",
    "=HYPERLINK(1)",
    r'$\frac{$ `code` *x* [bold red] [/] :smile: " onload="x" &lt;b&gt;',
)
STRANGE = [word + STEERING for word in LIVE]
LENGTH, EPISODES = 24, 4


def dataset(root, words):
    """Record a dataset that says some words wherever words can stand."""
    task, mode, operator, reason, robot = words
    names = [f"{word}{place}" for place, word in enumerate(words)]
    features = {
        "observation.state": Feature("float32", (5,), tuple(names)),
        "observation.environment_state": Feature("float32", (5,), tuple(reversed(names))),
        "action": Feature("float32", (5,), tuple(names)),
        "teleop.values": Feature("float32", (5,), tuple(names)),
        "teleop.mask": Feature("bool", (5,), tuple(names)),
        "teleop.mode": Feature("string"),
        "teleop.device": Feature("string"),
        "controller.smallest_distance": Feature("float32"),
    }
    rng = np.random.default_rng(0)
    with EpisodeWriter.create(root, Manifest(REPO, FPS, robot, features)) as writer:
        for episode in range(EPISODES):
            for index in range(LENGTH + episode):
                move = np.sin(0.1 * index + np.arange(5)) + 0.01 * rng.normal(size=5)
                numbers = {key: move.astype(np.float32) for key in list(features)[:4]}
                said = {"teleop.mode": mode, "teleop.device": "", "controller.smallest_distance": 0.1}
                writer.add_frame(numbers | said | {"teleop.mask": np.ones(5, bool)}, f"{task}{episode % 2}")
            texts = {"mode": mode, "operator": operator, "robot": robot, "robot_client": robot}
            texts["environment"] = f"{task}{episode % 2}"
            texts["settings"] = json.dumps({"task": task, "mode": mode, "robot": robot})
            texts |= {words[place].replace("/", ""): words[0] for place in (0, 2)}  # columns of a stranger's
            ended = {"success": episode % 2 == 0, "failure_reason": reason * (episode % 2), "seed": 1}
            writer.save_episode(ended | texts)
    (root / f"{words[3]}.txt".replace("/", "")[:80]).write_text("x")
    (root / "data" / f"{words[1]}".replace("/", "")[:80]).write_text("x")
    return root
