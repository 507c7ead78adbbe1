"""`handrail-compare` works on anybody's datasets, says what does not apply, and never claims too much."""

import csv
import html
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from command_helpers import refused
from compare_helpers import JOINTS, evaluations, handrail_dataset, lerobot_dataset

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.compare import compare
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.comparison.headline import cautions, headline
from handrail.datasets.comparison.page import dataset_report
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import measure
from handrail.datasets.quality.takeover import TAKE_OVER
from handrail.datasets.reading.load import read_demonstrations

pytestmark = pytest.mark.usefixtures("few_resamples")


@pytest.fixture(scope="module")
def foreign(tmp_path_factory):
    """Two datasets of another robot, not made by Handrail."""
    folder = tmp_path_factory.mktemp("foreign")
    return [
        str(lerobot_dataset(folder / name, JOINTS, 30, jitter, name == "calm"))
        for name, jitter in (("calm", 0.01), ("shaky", 0.3))
    ]


@pytest.fixture(scope="module")
def foreign_report(foreign, few_resamples, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    return report(foreign, folder), (folder / "report.html").read_text()


@pytest.fixture(scope="module")
def mixed_report(foreign, ours, few_resamples, tmp_path_factory):
    """A dataset that Handrail did not make beside one that it made."""
    folder = tmp_path_factory.mktemp("report")
    return report([foreign[0], ours[0]], folder)[1], (folder / "episodes.csv").read_text()


def report(arguments, folder, **options):
    comparison = compare(CompareConfig(tuple(arguments), str(folder), **options))
    files = dataset_report(comparison).write(folder)
    return comparison, json.loads((folder / "report.json").read_text(), parse_constant=_no_constant), files


def of_all(content):
    """Return the contrasts of metrics of all episodes."""
    return [each for each in content["contrasts"] if each["view"] == "all episodes"]


def metrics_of(content):
    """Return the metrics of all episodes, by name and group."""
    found = {}
    for each in content["values"]:
        if each["view"] == "all episodes" and each["metric"] not in ("success", "successes_an_hour"):
            found.setdefault(each["metric"], {})[each["group"]] = each
    return found


def _no_constant(name):
    raise AssertionError(f"{name} is no JSON")


def test_two_datasets_that_handrail_did_not_make(foreign_report):
    (_, content, files), page = foreign_report
    assert [file.name for file in files] == ["report.html", "report.json", "episodes.csv", "differences.csv"]
    metrics = metrics_of(content)
    applies = {name for name, groups in metrics.items() if groups["calm"]["estimate"] is not None}
    never = {"contacts", "impulse", "smallest_distance", "time_within_margin", "slack_used", "input_effort"}
    never |= {"input_reversals", "active_axes", "mode_switches", "input_idle"}
    never |= {"undos", "input_age", "round_trip", *(metric.name for metric in TAKE_OVER)}
    assert applies == {metric.name for metric in METRICS} - never
    for name in never:
        assert metrics[name]["shaky"]["does_not_apply"].startswith("no column")
        (metric,) = [metric for metric in METRICS if metric.name == name]
        assert re.search(rf"{metric.title}</td><td>calm, shaky</td><td>no column", page)
    assert metrics["tracking_error"]["calm"]["estimate"] == pytest.approx(0.0, abs=1e-6)
    found = {each["metric"]: each for each in of_all(content)}
    assert found["ldlj"]["estimate"] < 0 < found["action_variance"]["estimate"]
    assert "calm" in page
    assert "wave" in page
    pictures = re.findall(r"data:image/jpeg;base64,([^\"]+)", page)
    assert len(set(pictures)) == len(pictures) == 3  # the first of each of the first three episodes


def test_the_page_needs_nothing_else(foreign_report):
    _, page = foreign_report
    addresses = re.findall(r'(?:src|href)="([^"]{0,30})', page)
    assert addresses
    assert all(address.startswith("data:image/") for address in addresses)
    assert "<script" not in page
    assert page.index("headline") < page.index('class="card"') < page.index('class="panels')


def test_the_page_says_which_episodes_to_look_at_first(foreign_report):
    (comparison, _, _), page = foreign_report
    section = page.split("Episodes to look at first")[1].split("</section>")[0]
    shaky = section.split("<summary>shaky</summary>")[1].split("</details>")[0]
    (metric,) = [metric for metric in METRICS if metric.name == "sparc"]
    ((told, command),) = re.findall(rf">{re.escape(metric.title)}</td><td>(.*?)</td><td>(.*?)</td>", shaky)
    values = comparison.everything.measurements.values["sparc"]["shaky"].values
    worst = [str(number) for number in np.argsort(values)[:3]]  # more negative is less smooth
    assert re.findall(r"(\d+) \(", told) == worst
    assert str(sorted(map(int, worst))) in html.unescape(command)


def test_the_same_seed_gives_the_same_report(ours, tmp_path):
    for name in ("one", "two"):
        report(ours, tmp_path / name)
    for name in ("episodes.csv", "differences.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    one, two = ((tmp_path / name / "report.html").read_text() for name in ("one", "two"))
    assert one == two


def test_inapplicable_numbers_are_empty_and_never_zero(mixed_report):
    rows = list(csv.DictReader(mixed_report[1].splitlines()))
    assert {row["contacts"] for row in rows if row["group"] == "calm"} == {""}
    assert [row["contacts"] for row in rows if row["group"] == "quick"][:3] == ["0.0", "1.0", "0.0"]
    assert not any("nan" in value for row in rows for value in row.values())


def test_different_columns_are_not_put_on_one_scale(mixed_report):
    content, _ = mixed_report
    reasons = {each["metric"]: each.get("does_not_apply", "") for each in of_all(content)}
    assert "no common scale" in reasons["state_coverage"]
    assert reasons["length"] == ""
    assert any("units may differ" in text for text in content["cautions"])


def test_nothing_is_claimed_where_nothing_differs(ours):
    assert any(
        "No evaluations" in text
        for text, holds in cautions(compare(CompareConfig(tuple(ours)))).items()
        if holds
    )
    same = compare(CompareConfig((ours[0], ours[0]), labels=("one", "other")))
    assert not any(each.detected for each in same.everything.differences)
    assert headline(same).count("no difference detected") == 2


def test_evaluations_are_in_the_report(ours, tmp_path):
    given = evaluations(tmp_path / "evaluations.json", 3, quick=0.9, slow=0.5)
    _, content, _ = report(ours, tmp_path, evaluations=(given,))
    assert content["contrasts"][0]["nested"][1] < 0
    assert any("training seeds" in text for text in content["cautions"])
    assert content["policies"][0]["label"] == "quick"
    wrong = evaluations(tmp_path / "wrong.json", 1, telepathy=0.9)
    with pytest.raises(HandrailError, match="unknown condition 'telepathy', expected one of quick, slow"):
        compare(CompareConfig(tuple(ours), evaluations=(wrong,)))


def test_columns_may_be_named(foreign):
    episodes = read_demonstrations(foreign[0], replace(CompareConfig(()).columns, asked="action"))
    found = measure({"calm": episodes}, np.random.default_rng(0)).values
    assert found["input_effort"]["calm"].known.size
    assert not found["contacts"]["calm"].known.size


def test_one_episode_is_enough_to_say_that_it_is_too_few(tmp_path):
    roots = [handrail_dataset(tmp_path / name, 100, name, 1) for name in ("a", "b")]
    comparison, content, _ = report(roots, tmp_path / "out")
    reasons = [each["does_not_apply"] for each in of_all(content)]
    assert "fewer than 5 episodes of a group have a value" in reasons
    assert metrics_of(content)["action_variance"]["a"]["does_not_apply"] == "there is only one episode"
    assert not any(each.detected for each in comparison.everything.differences)
    assert headline(comparison).count("no difference detected") == 1


BOTH = ("{quick}", "{slow}")
WRONG = [
    ((), "DATASETS|expected one folder"),
    (("{quick}",), "expected 2 to 8 groups of episodes, got quick; name another dataset, or say --by mode"),
    (("{quick}", "nowhere"), "nowhere.*expected a folder, found none"),
    ((*BOTH, "--by", "colour"), "unknown column 'colour'"),
    ((*BOTH, "--labels", "a"), "--labels: expected 2 names, got 1"),
    (("{quick}", "{quick}"), r"two datasets are called 'set/quick'"),
    ((*BOTH, "--baseline", "z"), "unknown baseline 'z': expected one of quick, slow"),
    ((*BOTH, "--margin", "-1"), "--margin: expected a number >= "),
    ((*BOTH, "--output", "{quick}/meta/info.json"), "expected a folder, but '.*info.json' is a file"),
    ((*BOTH, "--output", "{link}"), "expected a folder, but '.*/gone' is a link to nowhere"),
    (("nowhere", "--output", "{quick}/meta/info.json/a/b"), "expected a folder, but '.*info.json' is a file"),
    ((*BOTH, "--evaluations", "no.json"), "no.json': expected evaluations"),
    ((*BOTH, "--speed", "9"), "--speed"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG)
def test_wrong_input_is_one_line(arguments, message, ours, tmp_path):
    (link := tmp_path / "gone").symlink_to(tmp_path / "nowhere")
    words = [word.format(quick=ours[0], slow=ours[1], link=link) for word in arguments]
    line = refused(*words, name="compare")
    assert re.search(message, line), line
