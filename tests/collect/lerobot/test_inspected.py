"""A dataset that `lerobot-record` makes of `handrail_sim` says in a table how its episodes went."""

import numpy as np
import pytest
from command_helpers import command
from datasets_helpers import record_with_lerobot
from lerobot_helpers import steered

from handrail.collect.lerobot import HandrailSim
from handrail.collect.lerobot.mode_action import NEXT
from handrail.datasets.quality.summary import summarize
from handrail.datasets.reading.naming import point_entries
from handrail.datasets.reading.simulated import ROBOT

FPS = 20


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """One to the goal, one that begins with it reached, and one just before; both end in a new scene."""
    folder = tmp_path_factory.mktemp("lerobot")
    seen: list[list[dict]] = [[], []]
    with steered(folder) as (robot, teleop):
        while len(seen[0]) < 300 and not robot.loop.now.success:
            seen[0].append(robot.get_observation())
            robot.send_action(teleop.get_action())
        seen[0].append(robot.get_observation())
        for _ in range(10):
            seen[1].append(robot.get_observation())
            robot.send_action(robot.action.still() | {NEXT: float(len(seen[1]) == 1)})
    seen.append([row | {"success": float(number > 1)} for number, row in enumerate(seen[1])])
    for number, row in enumerate(seen[2]):
        row["scene"] = seen[0][0]["scene"] + (number > 3)
    seen[1][4]["contacts"], seen[1][5]["contacts"] = 2.0, 1.0
    names = list(seen[0][0])
    features = {
        "observation.state": {"dtype": "float32", "shape": (len(names),), "names": names},
        "action": {"dtype": "float32", "shape": (1,), "names": ["gripper"]},
    }
    rest = {"action": np.zeros(1, np.float32), "task": "reach"}
    episodes = [
        [{"observation.state": np.array(list(row.values()), np.float32), **rest} for row in episode]
        for episode in seen
    ]
    root = record_with_lerobot(folder / "set", features, episodes, FPS, HandrailSim.name)
    return root, seen


def test_success_distance_and_contacts_are_those_of_the_state(recorded):
    root, seen = recorded
    assert HandrailSim.name == ROBOT
    assert seen[1][0]["success"] == 1.0  # of the first episode's scene
    first, second, third = summarize(root)
    assert (first.success, second.success, third.success) == (True, False, False)
    assert (first.contacts, second.contacts) == (0, 2)
    for summary, episode in ((first, seen[0]), (second, seen[1])):
        nearest = min(row["distance"] for row in episode)
        assert summary.smallest_distance == pytest.approx(nearest, abs=1e-6)
    names = tuple(seen[0][0])
    assert [names[place].removesuffix(".pos") for place in point_entries(names)] == [
        "tool.x",
        "tool.y",
        "tool.z",
    ]
    assert point_entries(("x.pos", "tool.x.pos", "tool.y.pos", "tool.z.pos")) == [1, 2, 3]
    shown = command(root, name="inspect")
    assert "3 episodes, 1 succeeded" in shown.stdout


def test_another_robot_s_state_means_what_its_names_mean_there(recorded, tmp_path):
    """`distance` and `success` of a robot that is not ours may be anything."""
    import json
    import shutil

    root = shutil.copytree(recorded[0], tmp_path / "other")
    info = json.loads((root / "meta/info.json").read_text())
    (root / "meta/info.json").write_text(json.dumps(info | {"robot_type": "so101"}))
    for summary in summarize(root):
        assert (summary.success, summary.contacts, summary.smallest_distance) == (None, None, None)
