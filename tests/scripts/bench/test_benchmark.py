"""Laws of the bench `goal_reaching`: paired, reproducible, self-contained; the masked MPC arrives."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from graphics import graphics_trouble
from rich.console import Console

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import load_model
from handrail.scripts.bench.goal_reaching.benchmark import benchmark, write_page
from handrail.scripts.bench.goal_reaching.config import BASELINES, BenchmarkConfig
from handrail.scripts.bench.goal_reaching.metrics import METRICS
from handrail.scripts.bench.goal_reaching.run import available, conditions, goals, run, trace_of
from handrail.scripts.bench.goal_reaching.tables import benchmark_tables

MODEL = load_model()
QUIET = Console(quiet=True)
TIMED = ("wall_time_s", "cpu_time_s", "update_ms_median")  # what depends on the machine
QUICK = BenchmarkConfig(controllers="mpc,dls", goals=2, physics=False, video=False)


def rows(config, *names):
    who = tuple(BASELINES[name] for name in names)
    found = [episode.row for episode in run(config, who)]
    found.sort(key=lambda row: (row["goal"], row["profile"], row["controller"]))
    return [{key: value for key, value in row.items() if key not in TIMED} for row in found]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("benchmark")
    config = replace(
        QUICK,
        page=str(folder / "page.md"),
        profile="nominal,fast3",
        video=not graphics_trouble(),
    )
    return folder, benchmark(config, BASELINES, QUIET)


def test_the_page_has_its_figures_and_an_example(written):
    folder, results = written
    names = ["distributions", "paths", "profiles", "paired", "example"][: 5 - bool(graphics_trouble())]
    for name in names:
        picture = (folder / f"page_nominal_fast3_ideal_seed_1_{name}.png").read_bytes()
        assert picture.startswith(b"\x89PNG")
        assert len(picture) > 5_000
    assert results["titles"]["mpc"] == "masked MPC"
    shown = " ".join(str(cell) for table in benchmark_tables(results) for row in table.rows for cell in row)
    for words in ("paper: RL", "paper: proposed", "0.098 ± 0.047"):
        assert words in shown


def test_the_page_keeps_what_others_wrote(written):
    folder, results = written
    page = folder / "page.md"
    config = replace(QUICK, profile="nominal,fast3")
    first = page.read_text()
    assert all((folder / link).is_file() for link in re.findall(r"\]\((.+?)\)", first))
    beside = json.loads((folder / "page_nominal_fast3_ideal_seed_1.json").read_text())
    for row in results["episodes"]:
        measured = beside["episodes"][row["profile"]][row["controller"]]
        assert not measured.keys() & TIMED
        assert measured.keys() >= set(METRICS) - set(TIMED)
        assert {name: values[row["goal"]] for name, values in measured.items()}.items() <= row.items()
    page.write_text("# Mine\n\nBefore.\n\n" + first.split("\n\n", 1)[1] + "\nAfter.\n")
    write_page(results, {}, page, config)
    again = page.read_text()
    assert again.startswith("# Mine\n\nBefore.\n")
    assert again.endswith("\nAfter.\n")
    assert again.count("<!-- nominal_fast3_ideal_seed_1 -->") == 1
    assert "![" not in again
    for other in (replace(config, seed=2), replace(config, profile="nominal,steps"), QUICK):
        write_page(results, {}, page, other)  # a part of its own: no other run's part is touched
        assert page.read_text().startswith(again.rstrip())
    assert replace(config, profile="all").label == "profiles_ideal_seed_1"


DROPOUTS = BenchmarkConfig(goals=2, profile="dropouts", physics=False)


def test_the_same_seed_gives_the_same_episodes_and_another_one_others():
    alone = rows(DROPOUTS, "dls")
    assert alone == rows(DROPOUTS, "dls")
    assert alone != rows(replace(DROPOUTS, seed=2), "dls")


@pytest.mark.slow
def test_several_processes_give_the_same_episodes():
    assert rows(DROPOUTS, "dls") == rows(replace(DROPOUTS, workers=2), "dls")


def test_goals_are_paired_and_do_not_depend_on_how_many_there_are():
    few, many = goals(BenchmarkConfig(goals=3)), goals(BenchmarkConfig(goals=30))
    for one, other in zip(few, many, strict=False):
        np.testing.assert_array_equal(one.position, other.position)
    one, other = (conditions(BenchmarkConfig(clutter=True), 5, "noise") for _ in range(2))
    np.testing.assert_array_equal(one.goal.position, other.goal.position)
    assert one.seed == other.seed
    for a, b in zip(one.scene.objects, other.scene.objects, strict=True):
        np.testing.assert_array_equal(a.position, b.position)


def test_clutter_leaves_start_and_way_free():
    hand = MODEL.pose(MODEL.description.home).position[:2]
    for index in range(12):
        given = conditions(BenchmarkConfig(clutter=True, seed=7), index, "nominal")
        collision = CollisionModel(MODEL, given.scene.obstacles())
        distances = collision.values(MODEL.description.home[None])[0]
        outside = [d for d, pair in zip(distances, collision.pairs, strict=True) if "cylinder" in pair[1]]
        assert min(outside) >= 0.2
        tall = [item for item in given.scene.objects if item.top > 1.0]
        assert len(tall) == 1
        way = hand + np.linspace(0, 1, 50)[:, None] * (given.goal.position[:2] - hand)
        assert np.linalg.norm(way - tall[0].position[:2], axis=1).min() >= 0.59


@pytest.mark.parametrize("name", ["mpc", "mpc_paper"])
def test_the_mpc_arrives_in_physics_without_contact(name):
    for episode in rows(BenchmarkConfig(goals=2), name):
        assert episode["success"]
        assert episode["final_position_error"] <= 0.101
        assert (episode["contacts"], episode["brakes"]) == (0, 0)
        assert episode["smallest_distance"] > 0.04


def test_a_planner_that_sees_the_hand_gets_it_there():
    config = BenchmarkConfig(goals=2, early_stop=False, closed_loop=True)
    for episode in rows(config, "mpc"):
        assert episode["planned_position_error"] <= 0.01
        assert episode["planned_orientation_error"] <= 0.001
        assert episode["final_position_error"] <= 0.003


def test_an_operator_with_the_low_pass_s_lag_does_not_ring():
    """A planner that does not know it swings about the goal, and the error grows while it settles."""
    config = BenchmarkConfig(goals=2, early_stop=False, closed_loop=True)
    known = BASELINES["mpc"]
    unknown = replace(known, lag=(0.0, 0.0))
    errors = [
        [1e3 * trace_of(config, baseline, index)[1].errors[-1, 0] for index in (0, 1)]
        for baseline in (known, unknown)
    ]
    assert max(errors[0]) <= 3.0 < min(errors[1])


def test_an_update_is_asked_for_at_its_period():
    """10 Hz against steps of 0.03 s: after 0, 4, 7, 10, 14, … steps."""
    _, trace = trace_of(replace(QUICK, goals=1), BASELINES["mpc"], 0)
    assert len(trace.updates) == int(np.ceil(len(trace.v) * 0.03 / 0.1))


def test_clutter_is_seen_by_the_mpc_and_not_by_plain_least_squares():
    config = BenchmarkConfig(goals=4, clutter=True, physics=False)
    found = rows(config, "mpc", "dls")
    contacts = {name: sum(r["contacts"] for r in found if r["controller"] == name) for name in ("mpc", "dls")}
    assert contacts["mpc"] == 0
    assert contacts["dls"] > 0


def _fails(model, period):
    raise HandrailError("robot missing")


def test_with_all_what_is_missing_is_left_out_and_said():
    broken = replace(BASELINES["mink"], build=_fails)
    baselines = dict.fromkeys(BASELINES, BASELINES["dls"]) | {"mink": broken}
    present, skipped = available(baselines, BenchmarkConfig(controllers="all"))
    assert len(present) == len(BASELINES) - 1
    assert skipped == {"mink": "robot missing"}
    with pytest.raises(HandrailError, match="robot missing"):
        available(baselines, BenchmarkConfig(controllers="dls,mink"))
