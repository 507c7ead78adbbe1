"""What the pages of results say in words agrees with the JSON beside them; limits come before rankings."""

import json
import re
import tarfile
from collections import Counter

import pytest
from places import ROOT

from handrail.datasets.statistics.proportions import holm
from handrail.datasets.statistics.student import student

RESULTS = ROOT / "docs" / "results"
LIMITS = (
    "scripts, not people",
    "is not the same thing twice",
    "probably better than people are",
    "policies see where things are",
    "chosen on `ee`",
    "a flat loss does not show",
    "was chosen so that policies neither all fail nor all succeed",
)
OLD_LIMITS = ("input and controller are not told apart", "was not declared before", "seeds of one recording")


def words(text):
    """Return a text without the parts that commands write, on one line."""
    written = r"<!-- (?P<label>[^>]+) -->.*?<!-- end (?:of )?(?P=label) -->"
    return " ".join(re.sub(written, "", text, flags=re.DOTALL).split())


TEXT = words((RESULTS / "goal_reaching.md").read_text())


def runs():
    """Return what the goal-reaching page keeps, by kind of run."""
    files = sorted(RESULTS.glob("goal_reaching_*.json"))
    return {file.stem.removeprefix("goal_reaching_"): json.loads(file.read_text()) for file in files}


def nominal(seed, name, metric, digits):
    return f"{runs()[f'nominal_seed_{seed}']['controllers'][name][metric]['mean']:.{digits}f}"


def contrast(name, kind):
    """Return a contrast of the study's success over both tasks."""
    study = json.loads((RESULTS / "teleop_modes_factors.json").read_text())
    assert study["missing"] == []
    (found,) = [
        each
        for each in study["contrasts"]
        if (each["name"].split(":")[0], each["kind"], each["measure"]) == (name, kind, "success")
        and len(each["tasks"]) == 2
    ]
    return found


def shares(name, kind):
    return [f"{100 * side:.0f}" for side in contrast(name, kind)["sides"]]


def test_limits_of_the_study_come_before_its_figures():
    page = (RESULTS / "teleop_modes.md").read_text()
    before = words(page.split("<!-- study factors -->")[0]).lower()
    assert [limit for limit in LIMITS if limit not in before] == []
    earlier = words(page.split("<!-- end of study factors -->")[1].split("What came out of the earlier")[0])
    assert [limit for limit in OLD_LIMITS if limit not in earlier.lower()] == []
    assert "97 %" not in earlier  # what `ee` had


def test_the_answer_is_told_as_it_came_out():
    """The page's own three sentences, and the README's."""
    answer = words((RESULTS / "teleop_modes.md").read_text().split("\n## ")[0])
    readme = words((ROOT / "README.md").read_text())
    with_mpc, without = shares("controller", "declared")
    hand, hand_without = shares("ee − ee_dls", "exploratory")
    joints, joints_without = shares("joints − direct", "exploratory")
    for text in (answer, readme):
        assert f"with the MPC succeeded in {with_mpc} %, " in text
        assert f"without it in {without} %" in text
        assert f"{hand} instead of {hand_without} %" in text
        assert f"({joints} and {joints_without} %" in text
        assert "scripted" in text
        assert "nothing of people" in text
    steered, joints = shares("input", "declared")
    assert f"({steered} and {joints} %; " in answer
    for name in ("controller", "input", "interaction"):
        ends = contrast(name, "declared")["estimate"]["interval"]
        low, high = (f"{100 * end:+.0f}".replace("-", "−") for end in ends)
        assert f"{low} to {high}" in answer, name


def test_failures_with_and_without_contact_are_told_as_they_came_out():
    answer = words((RESULTS / "teleop_modes.md").read_text().split("\n## ")[0])
    failed = Counter()
    with tarfile.open(RESULTS / "teleop_modes_factors.tar.xz") as archive:
        for member in archive:
            place = re.fullmatch(
                r"(?:\./)?evaluations/(\w+)/(\w+)/\d/nominal/realised-time.json", member.name
            )
            if place:
                content = json.load(archive.extractfile(member))
                (policies,) = content["arms"].values()
                rollouts = [rollout for policy in policies for rollout in policy["rollouts"]]
                failed.update(
                    (*place.groups(), each["contacts"] > 0) for each in rollouts if not each["success"]
                )
    ways = [
        [f"{failed[task, mode, touched]}" for mode in ("ee", "ee_dls")]
        for touched in (True, False)
        for task in ("reach", "pick_place")
    ]
    with_contact, and_pick_place, without, and_there = ways
    study = json.loads((RESULTS / "teleop_modes_factors.json").read_text())
    touched = {(each["task"], each["label"]): each["touched"] for each in study["conditions"]}
    hand, joints = (
        f"{50 * (touched['reach', mode] + touched['pick_place', mode]):.0f} %"
        for mode in ("ee_dls", "direct")
    )
    assert f"touched something in {hand} of their rollouts, those of the joints in {joints}" in answer
    for task in ("reach", "pick_place"):
        hand, joints = (100 * touched[task, mode] for mode in ("ee", "joints"))
        assert f"{hand:.0f} and {joints:.0f} % on `{task}`" in answer
    assert (
        f"{with_contact[0]} of `ee` and {with_contact[1]} of `ee_dls` failed after a contact on `reach`"
        in answer
    )
    assert f"(`pick_place`: {' and '.join(and_pick_place)}), {' and '.join(without)} without one" in answer
    assert f"without one ({' and '.join(and_there)})" in answer


@pytest.mark.parametrize(
    ("study", "ending"), [("number", ""), ("number", " (same number)"), ("learner", ""), ("early", "")]
)
def test_what_is_beside_the_study_is_told_as_it_came_out(study, ending):
    page = words((RESULTS / "teleop_modes_beside.md").read_text())
    study = json.loads((RESULTS / f"teleop_modes_beside_{study}.json").read_text())
    assert study["missing"] == []
    names = [
        "ee − ee_dls",
        "joints − direct",
        "interaction: what the MPC adds with the hand − with the joints",
        "ee − direct",
    ]
    names += ["ee − joints"] if ending else []
    found = {each["name"]: each["estimate"] for each in study["contrasts"] if each["measure"] == "success"}
    for name in names:
        estimate = found[name + ending]
        value, low, high = (
            f"{100 * each:+.0f}".replace("-", "−") for each in (estimate["value"], *estimate["interval"])
        )
        assert f"{value} ({low} to {high})" in page, name
    label = ending.replace(" (", " ").replace(")", "")
    shares = {each["label"]: each["success"]["value"] for each in study["conditions"]}
    told = ", ".join(f"{100 * shares[mode + label]:.0f}" for mode in ("ee", "ee_dls", "joints", "direct"))
    assert f"{told} %" in page


def test_what_came_of_pictures_is_told_as_it_came_out():
    page = words((RESULTS / "teleop_modes_beside.md").read_text())
    study = json.loads((RESULTS / "teleop_modes_beside_pictures.json").read_text())
    assert study["missing"] == []
    reached, turned = [], []
    for each in study["conditions"]:
        low, high = (f"{100 * end:.0f}" for end in each["interval"])
        reached.append(f"{each['successes']} ({low} to {high} %)")
        turned.append(f"{each['failures']['turn, moving']}")
        assert f"none of {each['rollouts']} goals each" in page
    assert f"| success | {' | '.join(reached)} |" in page
    assert f"| hand was at the goal, but not turned | {' | '.join(turned)} |" in page


def test_what_was_tried_of_direct_is_told_as_it_came_out():
    page = words((RESULTS / "diagnosis_direct.md").read_text())
    study = json.loads((RESULTS / "diagnosis_direct_diagnosis.json").read_text())
    assert study["missing"] == []
    for each in study["conditions"]:
        mode, actions = (*each["label"].split(), "")[:2]
        what = ", joint positions" if actions else "" if each["noise"] else ", `--noise 0`"
        low, high = (f"{100 * end:.0f}" for end in each["interval"])
        grasp, lift = (
            sum(count for way, count in each["failures"].items() if way.startswith(stage))
            for stage in ("grasp", "lift")
        )
        assert (
            f"| `{mode}`{what} | {100 * each['success']['value']:.0f} % ({low} to {high}) |"
            f" {grasp} | {lift} | {each['failures']['carry, dropped']} |"
        ) in page
    drawn = {(each["label"], each["noise"]): each["draws"] for each in study["conditions"]}
    for mode in ("ee", "direct"):
        lost = student([drawn[mode, 1.0][draw] - drawn[mode, 0.0][draw] for draw in "0123"])
        low, high = (f"{100 * end:.0f}" for end in lost.interval or ())
        told = re.search(rf"`{mode}` (?:loses )?(\d+) (?:points )?\({low} to {high}\)", page)
        assert told
        assert int(told[1]) == pytest.approx(100 * lost.value, abs=0.51)
    (worse,) = [each for each in study["contrasts"] if each["name"] == "direct targets − direct"]
    low, high = (f"{100 * end:.0f}".replace("-", "−") for end in worse["estimate"]["interval"])
    assert f"{100 * worse['estimate']['value']:.0f} points ({low} to {high})".replace("-", "−") in page


def test_the_readme_s_results_are_those_of_the_pages():
    readme = words((ROOT / "README.md").read_text())
    reached = {
        name: sum(
            round(run["success"]["mean"] * run["episodes"])
            for run in (runs()[f"nominal_seed_{seed}"]["controllers"][name] for seed in (1, 2, 3))
        )
        for name in ("mpc", "mink")
    }
    assert f"reached {reached['mpc']} of 300 goals without contact; `mink` {reached['mink']}" in readme
    clutter = runs()["nominal_clutter_seed_1"]["controllers"]["mpc"]
    assert f"touched nothing, and reached {100 * clutter['success']['mean']:.0f} of 100" in readme


def test_the_families_of_p_values_follow_from_the_study_s_json():
    """Holm over all nine, the six like for like, the three of `ee` and `direct`: the table in the page."""
    tasks = json.loads((RESULTS / "teleop_modes_full.json").read_text())["tasks"]
    raw = {
        (task, each["label"]): each["p"] for task in tasks for each in tasks[task]["policies"]["differences"]
    }
    shown = [
        ("reach", "ee"),
        ("tray", "ee"),
        ("pick_place", "ee"),
        ("reach", "leader"),
        ("pick_place", "leader"),
    ]
    page = (RESULTS / "teleop_modes.md").read_text().replace("**", "")
    for kept in (("ee", "leader", "ee intent"), ("ee", "leader"), ("ee",)):
        family = [key for key in raw if key[1] in kept]
        adjusted = dict(zip(family, holm([raw[key] for key in family]), strict=True))
        cells = [f"{adjusted[key]:.2g}" if key in adjusted else "–" for key in shown]
        assert f" {len(family)} " in page
        assert f"| {' | '.join(cells)} |" in page


@pytest.mark.parametrize(
    ("metric", "digits", "called"),
    [
        ("arm_effort", 1, "Arm effort"),
        ("jerkiness", 3, "jerkiness"),
        ("base_path", 2, "base path"),
    ],
)
def test_the_mpc_s_figures_are_those_of_the_tables(metric, digits, called):
    one, two, three = (nominal(seed, "mpc", metric, digits) for seed in (1, 2, 3))
    assert f"{called} {one}, {two} and {three}" in TEXT


def test_the_paper_s_horizon_is_told_as_it_came_out():
    found = {
        metric: nominal(1, "mpc_paper", metric, digits)
        for metric, digits in (("arm_effort", 1), ("jerkiness", 3), ("base_path", 2), ("length", 0))
    }
    assert (
        f"effort {found['arm_effort']}, jerkiness {found['jerkiness']}, base path {found['base_path']} m,"
        f" {found['length']} steps (published"
    ) in TEXT


def test_the_closed_loop_is_told_as_it_came_out():
    mpc = runs()["nominal_closed_loop_whole_seed_1"]["controllers"]["mpc"]
    before, after = mpc["planned_position_error"], mpc["final_position_error"]
    missed = f"{mpc['beyond_aim']['planned_position_error']} of {mpc['episodes']} goals beyond 10 mm"
    assert (
        f"{1e3 * before['mean']:.1f} mm off in the mean and {1e3 * before['max']:.1f} mm at worst, {missed}"
        in TEXT
    )
    assert f"it is {1e3 * after['mean']:.1f} mm and {1e3 * after['max']:.1f} mm" in TEXT
    assert ("**That is so**" in TEXT) == (
        after["mean"] < before["mean"] and after["max"] < before["max"] < 0.01
    )


def test_time_is_told_by_the_update_and_its_rate():
    took = [nominal(1, name, "update_ms_median", 2) for name in ("mpc", "rl")]
    rates = [nominal(1, name, "updates_per_s", 0) for name in ("mpc", "rl")]
    assert f"{took[0]} against {took[1]} ms" in TEXT
    assert f"{rates[0]} against {rates[1]} a second" in TEXT
    pages = (*RESULTS.glob("*.md"), *(ROOT / "docs").glob("*.md"), ROOT / "README.md", ROOT / "CHANGELOG.md")
    for document in pages:
        assert not re.search(r"% of the actor's (wall )?time", words(document.read_text()))


def test_what_the_low_pass_does_for_rivals_is_told():
    profiles = runs()["profiles_seed_1"]["profiles"]
    for profile in ("steps", "quantised"):
        for rival in ("mink", "rl"):
            bare, smooth = (
                f"{100 * profiles[profile][name]['success']['mean']:.0f}"
                for name in (rival, f"{rival}_low_pass")
            )
            assert f"`{rival}` {smooth} instead of {bare} of 100 goals ({profile})" in TEXT


def test_a_page_of_one_run_has_tables_of_one_run():
    assert "all tables are of one run" in TEXT
    assert all("updates_per_s" in run["controllers"]["mpc"] for run in runs().values())
    assert {run["machine"]["cores"] for run in runs().values()} == {2}
