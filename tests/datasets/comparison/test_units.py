"""Nothing is compared across units that are not known to be the same, and the report says why."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from compare_helpers import JOINTS, handrail_dataset, lerobot_dataset

from handrail.datasets.comparison.compare import compare
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.format.schema import Feature
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import measure
from handrail.datasets.quality.takeover import TAKE_OVER
from handrail.datasets.quality.units import why_not
from handrail.datasets.reading.demonstration import Demonstration
from handrail.datasets.reading.reader import DatasetInfo

NAMES = ("a.pos", "b.pos", "c.pos")
ARM = DatasetInfo(Path("one"), 20, "arm", {}, 6, 240, "", "", from_handrail=False)
OURS = replace(ARM, robot_type="ridgeback", from_handrail=True)
ABSOLUTE = {"length", "smallest_distance", "contacts", "impulse", "time_within_margin", "mode_switches"}
ABSOLUTE |= {"undos", "input_age", "round_trip", *(metric.name for metric in TAKE_OVER)}


def group(source=ARM, names=NAMES, scale=1.0, fps=20, action=1.0, mode="", seed=0):
    """Six episodes of an arm that follows its commands; `action` scales these against the state."""
    generator, found = np.random.default_rng(seed), []
    for number in range(6):
        state = scale * np.cumsum(generator.normal(size=(40, len(names or NAMES))), axis=0)
        frames = {"observation.state": state, "action": action * np.roll(state, -1, axis=0)}
        if mode:
            frames["teleop.mode"] = np.full(40, mode)
        entry = Feature("float64", state.shape[1:], names)
        info = replace(source, fps=fps, features={"observation.state": entry, "action": entry})
        found.append(Demonstration(number, info, frames, {"length": 40, "tasks": ["go"]}))
    return found


def apart(needs, one, other) -> str:
    """Return why episodes cannot be compared, once they were read."""
    found = measure({"one": one, "other": other}, np.random.default_rng(0), metrics=())
    return why_not(needs, *found.groups.values())


OTHER = replace(ARM, root=Path("other"))
UNNAMED = replace(ARM, robot_type="")
BARE = ("pan", "lift", "elbow")
UNKNOWN = {
    "no names": (group(names=None), group(OTHER, names=None), "have no names"),
    "other names": (group(), group(OTHER, names=("x.pos", "y.pos", "z.pos")), "other entries in the"),
    "names that say nothing": (
        group(names=BARE),
        group(OTHER, names=BARE),
        r"names in the .*pan, lift, elbow.* do not say whether it is positions or velocities",
    ),
    "other robot": (group(), group(replace(OTHER, robot_type="leg")), r"robots are not known .*arm and leg"),
    "no robot": (group(UNNAMED), group(replace(UNNAMED, root=Path("other"))), "not recorded and not"),
    "one of ours": (group(OURS), group(OTHER), "robots are not known"),
    "other rate": (group(), group(OTHER, fps=50), "frame rates differ"),
    "degrees": (group(), group(OTHER, scale=57.3), r"are 5\d times as large"),
}
KNOWN = {
    "one dataset": (group(names=None), group(names=None, scale=20.0, seed=1)),
    "the same robot": (group(), group(OTHER, scale=2.0, seed=1)),
    "ours": (
        group(OURS, names=("pan",)),
        group(replace(OURS, root=Path("other")), names=("pan",), scale=99.0),
    ),
}


@pytest.mark.parametrize("needs", ["motion", "jerk", "position", "action", "scale"])
@pytest.mark.parametrize(("one", "other", "reason"), UNKNOWN.values(), ids=UNKNOWN)
def test_columns_not_known_to_be_the_same_are_not_compared(one, other, reason, needs):
    found = apart(needs, one, other)
    if needs == "scale" and one[0].entries("state") != other[0].entries("state"):
        reason = "different columns"
    assert re.search(reason, found), found
    assert apart("", one, other) == ""


@pytest.mark.parametrize("needs", ["motion", "jerk", "position", "action", "scale"])
@pytest.mark.parametrize(("one", "other"), KNOWN.values(), ids=KNOWN)
def test_columns_known_to_be_the_same_are_compared(one, other, needs):
    assert apart(needs, one, other) == ""


def test_smoothness_needs_no_unit_where_both_are_a_tool_s():
    tool = ("tool.x", "tool.y", "tool.z")
    one, other = group(names=tool), group(replace(OTHER, robot_type="leg"), names=(*tool, "elbow.pos"))
    assert apart("motion", one, other) == ""
    assert "other entries" in apart("position", one, other)
    ours = [
        group(replace(OURS, root=Path(root)), names=names)
        for root, names in (("a", tool), ("b", (*tool, "q")))
    ]
    assert apart("position", *ours) == ""


def test_jerk_is_not_compared_between_frame_rates():
    """Law: of the same motions it grows with the rate; the spectrum up to 10 Hz does not."""
    tool, found = ("tool.x", "tool.y", "tool.z"), {each.name: each for each in METRICS}
    pair = group(OURS, names=tool, fps=60), group(replace(OURS, root=Path("other")), names=tool, fps=20)
    assert apart(found["ldlj"].needs, *pair) == "the frame rates differ, and jerk grows with them"
    assert apart(found["sparc"].needs, *pair) == ""


def test_commands_that_the_state_does_not_measure_alike():
    fast = group(action=20.0), group(OTHER, action=20.0)
    assert "commands and state differ 20 times" in apart("action", *fast)
    slow = group(replace(OURS, root=Path("other")), fps=50)
    assert "a frame later" in apart("action", group(OURS), slow)
    assert apart("scale", group(OURS), slow) == ""


def test_slack_is_in_the_unit_of_the_controller_s_own_limits():
    assert "modes differ" in apart("controller", group(mode="ee"), group(mode="direct_cbf"))
    assert apart("controller", group(mode="ee"), group(OTHER, mode="ee")) == ""


def test_every_metric_with_a_unit_of_its_dataset_says_what_that_hangs_on():
    assert {metric.name for metric in METRICS if not metric.needs} == ABSOLUTE


def test_only_what_is_on_one_scale_is_pooled():
    groups = {
        "a": group(),
        "b": group(OTHER, seed=1),
        "degrees": group(replace(ARM, root=Path("c")), scale=57.3),
    }
    found = measure(groups, np.random.default_rng(0))
    one, other, degrees = (each.scale for each in found.groups.values())
    assert one is other is not degrees


def test_a_foreign_arm_beside_ours(tmp_path):
    theirs = lerobot_dataset(tmp_path / "theirs", JOINTS, 30, 0.05, camera=False)
    ours = handrail_dataset(tmp_path / "ours", 100, "ee")
    found = compare(CompareConfig((str(theirs), ours)))
    tested = {each.measure.name for each in found.everything.differences if each.interval}
    assert tested == {"length"}
