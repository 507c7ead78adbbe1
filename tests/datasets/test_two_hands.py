"""Datasets of robots with several hands: each is measured by its own name, and nothing is left out."""

from pathlib import Path

import numpy as np
import pytest

from handrail.datasets.format.schema import Feature
from handrail.datasets.quality import motion
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import measure
from handrail.datasets.quality.scale import Scale
from handrail.datasets.quality.worst import ranking_metric
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply
from handrail.datasets.reading.naming import (
    gripper_entries,
    hand_names,
    point_entries,
    position_entries,
    quantity,
)
from handrail.datasets.reading.reader import DatasetInfo

AXES, OF_MOTION = "xyz", [metric for metric in METRICS if metric.is_of_motion]
TIAGO = (
    "left.gripper.opening",
    *(f"left.tool.{axis}" for axis in AXES),
    "right.gripper.opening",
    *(f"right.tool.{axis}" for axis in AXES),
)


def recorded(state, names, action=None, actions=()):
    """Return an episode of these columns."""
    frames = {"observation.state": state, "action": np.zeros((len(state), 1)) if action is None else action}
    entries = {"observation.state": tuple(names), "action": tuple(actions)}
    features = {key: Feature("float32", each.shape[1:], entries[key]) for key, each in frames.items()}
    info = DatasetInfo(Path(str(len(names))), 20, "robot", features, 1, 1, "", "", from_handrail=True)
    return Demonstration(0, info, frames, {"length": len(state)})


def walk(seed, count=80):
    return np.cumsum(np.random.default_rng(seed).normal(size=(count, 3)), axis=0)


def two_handed(left, right):
    shut = np.zeros((len(left), 1))
    return recorded(np.hstack([shut, left, shut, right]), TIAGO)


@pytest.mark.parametrize(
    ("names", "hands", "tools", "grippers"),
    [
        (TIAGO, ("left", "right"), [1, 2, 3, 5, 6, 7], [0, 4]),
        (
            [f"{name}.pos" for name in TIAGO] + ["sent.left.gripper.pos", "sent.right.gripper.pos"],
            ("left", "right"),
            [1, 2, 3, 5, 6, 7],
            [0, 4],
        ),
        (("left_elbow.pos", "left_gripper.pos", "right_gripper.pos"), ("left", "right"), [], [1, 2]),
        (("l_gripper.pos", "lift.pos", "r_gripper.pos"), ("l", "r"), [], [0, 2]),
        (("gripper.opening.pos", "tool.x.pos", "tool.y.pos", "tool.z.pos", "sent.left"), (), [1, 2, 3], [0]),
        (("arm_elbow.pos", "arm_gripper.pos"), (), [], [1]),
        (("gripper", "gripper.vel"), (), [], []),
    ],
)
def test_hands_are_told_apart_by_names(names, hands, tools, grippers):
    assert hand_names(names) == hands
    assert point_entries(names) == tools
    assert gripper_entries(names) == grippers


@pytest.mark.parametrize("hands", [("",), ("left.", "right.")])
def test_scene_and_tool_are_no_configuration(hands):
    """Law: it is the same of what `lerobot-record` and what `handrail-record` made with our robot."""
    around = [f"{hand}{part}" for hand in hands for part in ("gripper.opening", "tool.x", "tool.qw")]
    around += ["goal.x", "obstacle_0.radius"]
    moving = ["theta.pos", "left_elbow.pos", "theta.vel", "left_elbow.vel"]
    for names in ((*moving, *around), (*moving, *(f"{name}.pos" for name in around))):
        assert position_entries(names) == [0, 1]
        assert position_entries(names, "left") == [1]


def test_positions_of_other_robots_are_their_configuration():
    """Also where the names of hands end in a dot, or all names have one."""
    own = ("pan.pos", "left.elbow.pos", "left.gripper.pos", "right.gripper.pos", "goal.x.pos")
    assert position_entries(own) == [0, 1, 2, 3]
    assert position_entries(own, "left") == [1, 2]
    assert position_entries(("main.elbow.pos", "main.elbow.vel")) == [0]


def test_a_hand_is_measured_as_if_it_were_the_only_one():
    """Whatever the other one does; with the hands exchanged, so are their values."""
    left, right = walk(0), walk(1)
    alone = recorded(left, [f"tool.{axis}" for axis in AXES])
    for metric in OF_MOTION:
        expected = metric.measure(alone, Scale())
        assert metric.of_hand("left").measure(two_handed(left, right), Scale()) == expected
        assert metric.of_hand("right").measure(two_handed(right, left), Scale()) == expected
        assert metric.measure(two_handed(left, right), Scale()) != expected  # it is of both


def test_every_hand_has_its_values_and_one_hand_has_no_others():
    episodes = [two_handed(walk(seed), walk(seed + 9)) for seed in range(3)]
    measured = measure({"two": episodes}, np.random.default_rng(0))
    own = [f"{hand}.{metric.name}" for metric in OF_MOTION for hand in ("left", "right")]
    assert set(measured.values) == {metric.name for metric in METRICS} | set(own)
    assert [metric.name for metric in measured.metrics] == list(measured.values)
    values = measured.values["right.sparc"]["two"].values
    assert values.tolist() == [motion.sparc.of_hand("right").measure(each, Scale()) for each in episodes]
    for each in filter(lambda metric: metric.good, measured.metrics):  # `--worst` ranks by any of them
        found = measure({"two": episodes}, np.random.default_rng(0), metrics=[ranking_metric(each.name)])
        np.testing.assert_array_equal(
            found.values[each.name]["two"].values, measured.values[each.name]["two"].values
        )
    single = recorded(walk(0), [f"tool.{axis}" for axis in AXES])
    alone = measure({"one": [single]}, np.random.default_rng(0))
    assert list(alone.metrics) == list(METRICS)
    both = measure({"one": [single], "two": episodes}, np.random.default_rng(0))
    assert "called left" in both.values["left.sparc"]["one"].reason


def test_a_phase_ends_where_any_hand_s_gripper_closes():
    closed = np.zeros((30, 2))
    closed[10:, 0], closed[20:, 1] = 1.0, 1.0
    joints = ("left_pan.pos", "right_pan.pos")
    episode = recorded(walk(0, 30)[:, :2], joints, closed, ("left_gripper.pos", "right_gripper.pos"))
    assert motion.phase_boundaries(episode, Scale()).tolist() == [10, 20]
    assert motion.phase_boundaries(episode.of_hand("left"), Scale()).tolist() == [10]
    assert episode.of_hand("right").motion.tolist() == episode.matrix("state")[:, 1:].tolist()
    with pytest.raises(DoesNotApply, match="third"):
        episode.of_hand("third")


def test_a_hand_s_point_is_a_position():
    assert quantity("left.tool.x") == quantity("tool.qw") == "position"
    assert quantity("knee.x") == ""


def test_a_gripper_that_trembles_is_told_by_the_widest_opening_of_all_episodes():
    """Whatever is measured besides, and whatever an episode lacks."""
    joints, rng = ("pan.pos", "lift.pos"), np.random.default_rng(0)
    openings = [np.repeat([60.0, 2.0], 40)[:, None], rng.uniform(0.0, 0.3, (80, 1)), np.full((80, 1), np.nan)]
    episodes = [recorded(walk(0)[:, :2], joints, each, ("gripper.pos",)) for each in openings]
    asked = {"metrics": [motion.path_efficiency]}
    found = [
        measure({"": some}, rng, **how).values["path_efficiency"][""].values[:2]
        for some, how in ((episodes[:2], {}), (episodes[:2], asked), (episodes, {}))
    ]
    assert found[0].tolist() == found[1].tolist() == found[2].tolist()
    still = recorded(walk(0)[:, :2], joints, np.zeros((80, 1)), ("gripper.pos",))
    assert found[0][1] == motion.path_efficiency.measure(still, Scale())
