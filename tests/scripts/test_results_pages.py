"""What the pages of the study say in words agrees with the JSON and the archive beside them."""

import json

from places import ROOT
from results_helpers import RESULTS, words

from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.model import load_model


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


def points(*values):
    """Return shares as the pages write points: `+24 (+19 to +30)`, or one of them alone."""
    value, *ends = (f"{100 * each:+.0f}".replace("-", "−") for each in values)
    return f"{value} ({' to '.join(ends)})" if ends else value


def told(estimate):
    return points(estimate["value"], *estimate["interval"])


def test_the_answer_begins_with_the_interaction():
    """The page's first table, and the README's sentence."""
    answer = words((RESULTS / "teleop_modes.md").read_text().split("\n## ")[0]).replace("**", "")
    readme = words((ROOT / "README.md").read_text())
    for one, other in (("ee", "ee_dls"), ("joints", "direct")):
        name = f"{one} − {other}"
        with_mpc, without = shares(name, "exploratory")
        gain = told(contrast(name, "exploratory")["estimate"])
        assert f"| `{one}` {with_mpc} % | `{other}` {without} % | {gain}, explored |" in answer
    tested = contrast("interaction", "declared")
    assert tested["p_adjusted"] < 0.001
    assert f"the interaction | | | {told(tested['estimate'])}, declared and tested, p < 0.001" in answer
    for name, detected in (("controller", ""), ("input", ", not detected")):
        inside = told(contrast(name, "declared")["estimate"]).removesuffix(")")
        assert f"{inside}{detected}; {' and '.join(shares(name, 'declared'))} %)" in answer
    (hand, bare), (joints, direct) = (
        shares(name, "exploratory") for name in ("ee − ee_dls", "joints − direct")
    )
    gains = [
        f"{100 * contrast(name, 'exploratory')['estimate']['value']:.0f}"
        for name in ("ee − ee_dls", "joints − direct")
    ]
    assert f"adds {gains[0]} points of policy success where the hand is steered ({hand} instead" in readme
    assert (
        f"of {bare} %), and {gains[1]}, not detected, where the joints are ({joints} and {direct} %)"
        in readme
    )


def test_where_the_lead_over_direct_is_undecided_is_told_beside_it():
    answer = words((RESULTS / "teleop_modes.md").read_text().split("\n## ")[0])
    number = json.loads((RESULTS / "teleop_modes_beside_number.json").read_text())
    study = json.loads((RESULTS / "teleop_modes_factors.json").read_text())
    found = [
        contrast("ee − direct", "exploratory"),
        *(each for each in number["contrasts"] if each["name"] == "ee − direct (same number)"),
        *(
            each
            for each in study["contrasts"]
            if (each["name"], each["tasks"], each["measure"]) == ("ee − direct", ["pick_place"], "clean")
        ),
    ]
    first, second, third = (told(each["estimate"]) for each in found)
    low, high = found[1]["estimate"]["interval"]
    assert low < 0 < high
    low, high = found[2]["estimate"]["interval"]
    assert low < 0 < high
    assert f"is {first}." in answer
    assert f"on `reach` ({second.replace(' (', ', ')}" in answer
    assert f"contact count ({third.replace(' (', ', ')}" in answer


def test_how_damped_least_squares_weighs_is_told_from_the_robot():
    """`W = diag(1 / v_max)`: what a radian of a joint costs beside a metre of the base."""
    speeds = load_model("ridgeback_ur10").description.limits.velocity
    cheaper = (speeds[3:] / speeds[0]) ** 2
    answer = words((RESULTS / "teleop_modes.md").read_text().split("\n## ")[0])
    assert f"costs {cheaper.min():.0f} to {cheaper.max():.0f} times less than a metre of the base" in answer
    settings = MpcSettings()
    assert settings.base_velocity < settings.arm_velocity  # it moves the base first
    assert f"looks {settings.horizon * settings.dt:.0f} s ahead" in answer
    assert f"looks {settings.horizon * settings.dt:.0f} s ahead" in words(
        (RESULTS / "operators.md").read_text()
    )


def test_success_and_contact_are_told_as_they_came_out():
    page = words((RESULTS / "teleop_modes.md").read_text())
    study = json.loads((RESULTS / "teleop_modes_factors.json").read_text())
    found = {(each["task"], each["label"]): each for each in study["conditions"] if each["treatment"] == ""}
    clean = {
        (task, mode): side
        for each in study["contrasts"]
        if each["measure"] == "clean" and len(each["tasks"]) == 1 and ":" not in each["name"]
        for task in each["tasks"]
        for mode, side in zip(each["name"].split(" − "), each["sides"], strict=True)
    }
    for what, modes in (("hand", ("ee", "ee_dls")), ("joints", ("joints", "direct"))):
        both = [(task, mode) for task in ("reach", "pick_place") for mode in modes]
        cells = [
            f"`{mode}` {100 * found[task, mode]['success']['value']:.0f} %"
            f" ({round(found[task, mode]['touched'] * found[task, mode]['rollouts'])})"
            for task, mode in both
        ]
        assert f"| {' | '.join(cells)} |" in page
        cells = [f"{100 * clean[cell]:.0f} %" for cell in both]
        assert f"| success without contact: {what} | {' | '.join(cells)} |" in page


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
    losses = study["jobs"]["policy/reach/ee/0/realised-time"]["result"]["validation"]
    assert f"its loss on held-out episodes is {list(losses.values())[-1]:.3f} in the end" in page
