"""The benchmark's measures against hand-computed values."""

import numpy as np
import pytest

from handrail.collect.world.tasks.goal_reaching import STEP
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.command import Diagnostics, Status
from handrail.controllers.robot.model import load_model
from handrail.scripts.bench.goal_reaching.config import BASELINES, BenchmarkConfig
from handrail.scripts.bench.goal_reaching.metrics import (
    METRICS,
    Trace,
    arm_effort,
    jerkiness,
    measure,
    summarise,
)
from handrail.scripts.bench.goal_reaching.tables import profile_tables

MODEL = load_model()
COLLISION = CollisionModel(MODEL)


def trace(steps=4, end=4, errors=(0.05, 0.01), contacts=()):
    """The base drives 0.1 m along x a step; shoulder and elbow turn with 0.3 and 0.4 rad/s."""
    home = MODEL.description.home
    q = home + np.outer(np.arange(steps + 1), np.eye(9)[0] * 0.1)
    v = np.tile([0.1 / STEP, 0, 0, 0.3, 0, 0.4, 0, 0, 0], (steps, 1))
    return Trace(
        q=q,
        v=v,
        errors=np.tile(errors, (steps, 1)),
        hand=q[:, :3],
        contacts=[tuple(contacts)] + [()] * (steps - 1),
        updates=[
            Diagnostics(Status.OK, 1e-3),
            Diagnostics(Status.BACKUP, 2e-3),
            Diagnostics(Status.CLIPPED, 3e-3),
        ],
        end=end,
        wall_time=0.5,
        cpu_time=0.4,
    )


def test_a_row_is_what_happened():
    row = measure(trace(contacts=("palm – floor",)), COLLISION, 3)
    assert row["success"]
    assert row["length"] == 4
    assert row["base_path"] == pytest.approx(0.4)
    assert row["arm_effort"] == pytest.approx(4 * (0.09 + 0.16))
    assert row["jerkiness"] == pytest.approx(0.0)
    assert (row["contacts"], row["contact_names"], row["brakes"]) == (1, ["palm – floor"], 1)
    assert row["update_ms_median"] == pytest.approx(2.0)
    assert row["updates_per_s"] == pytest.approx(3 / (4 * STEP))
    assert row["smallest_distance"] == pytest.approx(COLLISION.values(MODEL.description.home[None]).min())
    assert row["planned_position_error"] == pytest.approx(0.05)


def test_an_episode_that_ended_before_the_planner_has_no_planned_error():
    row = measure(trace(end=5), COLLISION, 3)
    assert row["planned_position_error"] is None
    assert not measure(trace(errors=(0.05, 0.06)), COLLISION, 3)["success"]
    assert not measure(trace(errors=(0.11, 0.01)), COLLISION, 3)["success"]


def test_jerkiness_is_a_mean_acceleration():
    """From rest at a constant acceleration a, ‖Δv‖ / h is a at every step; effort grows with the square."""
    a = np.array([0.3, 0.4])
    velocities = STEP * np.arange(10)[:, None] * a
    assert jerkiness(velocities) == pytest.approx(0.5)
    assert jerkiness(3.0 * velocities) == pytest.approx(1.5)
    assert arm_effort(3.0 * velocities) == pytest.approx(9.0 * arm_effort(velocities))
    assert np.isnan(jerkiness(velocities[:1]))


def row(goal, controller, **values):
    return measure(trace(), COLLISION, 3) | {
        "goal": goal,
        "profile": "nominal",
        "controller": controller,
        **values,
    }


def test_a_summary_is_over_the_episodes_and_pairs_are_by_goal():
    config = BenchmarkConfig(controllers="mpc,dls", goals=3)
    rows = [row(goal, "mpc", arm_effort=float(goal)) for goal in (2, 0, 1)]
    rows += [row(goal, "dls", arm_effort=10.0 + goal, success=goal > 0) for goal in (1, 2, 0)]
    results = summarise(rows, config, [BASELINES["mpc"], BASELINES["dls"]], {})
    mpc = results["controllers"]["mpc"]
    assert set(METRICS) <= set(mpc)
    assert all(set(mpc[metric]) >= {"mean", "std", "min", "max"} for metric in METRICS)
    effort = mpc["arm_effort"]
    assert (effort["mean"], effort["std"], effort["min"], effort["max"]) == (1.0, 1.0, 0.0, 2.0)
    assert results["controllers"]["dls"]["success"]["mean"] == pytest.approx(2 / 3)
    against = results["paired"]["nominal"]["dls"]
    assert against["arm_effort"]["mean"] == pytest.approx(-10.0)
    assert against["arm_effort"]["t_interval"] == pytest.approx((-10.0, -10.0))
    assert (against["success"]["only_first"], against["success"]["only_second"]) == (1, 0)
    assert len(results["episodes"]) == 6


def test_a_planner_that_sees_the_hand_is_held_to_its_aim():
    """Mean, worst and misses of 10 mm, when the planner ends and at the end, also where it got worse."""
    errors = [(0.002, 0.004), (0.014, 0.008), (0.005, 0.012)]
    rows = [
        row(goal, "mpc", planned_position_error=one, final_position_error=two)
        for goal, (one, two) in enumerate(errors)
    ]
    whole = BenchmarkConfig(controllers="mpc", goals=3, closed_loop=True, early_stop=False)
    results = summarise(rows, whole, [BASELINES["mpc"]], {})
    (table,) = [each for each in profile_tables(results, "nominal") if each.title == "nominal: settling"]
    assert table.headings[-1] == "beyond 10 mm"
    assert table.rows == [
        ["mpc", "the planner's last step", "7.0", "14.0", "1 of 3"],
        ["mpc", "4 s later", "8.0", "12.0", "1 of 3"],
    ]
    for other in (BenchmarkConfig(closed_loop=True), BenchmarkConfig(early_stop=False)):
        others = profile_tables(summarise(rows, other, [BASELINES["mpc"]], {}), "nominal")
        assert not [each for each in others if "settling" in each.title]
