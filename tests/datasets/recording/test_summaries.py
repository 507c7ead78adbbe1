"""The summary files of a dataset say what its episodes say, and what other tools add."""

import json
import re

import pytest
from compare_helpers import JOINTS, lerobot_dataset
from datasets_helpers import record_one, resume

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.tables import tasks_bytes
from handrail.datasets.reading import check
from handrail.datasets.reading.check import check_report, check_whole
from handrail.datasets.recording.repair import repair


@pytest.mark.parametrize("name", ["info.json", "tasks.parquet", "stats.json"])
def test_a_summary_that_is_not_there_or_of_other_episodes_is_noticed_and_mended(root, name):
    path = Layout(root).info.with_name(name)
    whole = path.read_bytes()
    if name == "info.json":  # as a crash leaves it between an episode and its summary
        path.write_bytes(whole.replace(b'"total_episodes": 4', b'"total_episodes": 3'))
    else:
        path.unlink()
    assert [fault.partition(":")[0].rpartition("/")[2] for fault in check_report(root)] == [name]
    repair(root)
    assert check_report(root) == []
    assert path.read_bytes() == whole


def _said_otherwise(path, change):
    """Change what a summary file says."""
    content = json.loads(path.read_bytes())
    change(content)
    path.write_text(json.dumps(content))


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda info: info.update(fps=25), "fps"),
        (lambda info: info.update(robot_type="panda"), "robot_type"),
        (lambda info: info["features"].pop("engaged"), "features?"),
        (lambda info: info["features"]["action"].update(names=["b", "a"]), "features?"),
    ],
)
def test_an_info_file_that_contradicts_the_manifest_is_refused(root, change, named):
    _said_otherwise(Layout(root).info, change)
    with pytest.raises(HandrailError, match=rf"\A[^\n]*handrail-edit repair [^\n]*{named}[^\n]*\Z"):
        check_whole(root)
    (fault,) = check_report(root)
    assert re.match(rf"meta/info.json: .* {named}; handrail-edit repair ", fault)
    repair(root)
    check_whole(root)
    assert check_report(root) == []


@pytest.mark.parametrize("said", [["drop the cup"], [], ["lift the cup", "drop the cup"]])
def test_other_tasks_than_the_episodes_have_are_noticed(root, said):
    Layout(root).tasks.write_bytes(tasks_bytes(said))
    (fault,) = check_report(root)
    assert fault.startswith("meta/tasks.parquet: ")
    repair(root)
    assert check_report(root) == []


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda stats: stats["action"].update(mean=[1.0, 2.0]), "action"),
        (lambda stats: stats.pop("action"), "action"),
        (lambda stats: stats.update(other=stats["action"]), "other"),
    ],
)
def test_statistics_of_other_rows_are_noticed_but_not_their_rounding(root, change, named):
    stats = Layout(root).stats
    _said_otherwise(
        stats, lambda said: said["action"].update(mean=[x + 1e-9 for x in said["action"]["mean"]])
    )
    assert check_report(root) == []
    _said_otherwise(stats, change)
    (fault,) = check_report(root)
    assert fault.startswith(f"meta/stats.json: not what the episodes say of {named}; handrail-edit repair ")
    repair(root)
    assert check_report(root) == []


def test_more_that_another_tool_says_of_a_column_is_no_fault(root):
    _said_otherwise(Layout(root).info, lambda info: info["features"]["action"].update(description="of ours"))
    check_whole(root)
    assert check_report(root) == []


def test_statistics_that_are_no_object_are_a_fault(tmp_path):
    root = lerobot_dataset(tmp_path / "set", JOINTS, 30, 0.0, camera=False)
    for content in "[]", '""', "null", "[1]":
        Layout(root).stats.write_text(content)
        assert len(check_report(root)) == 1


def test_an_episode_that_is_saved_during_the_check_is_no_fault(root, monkeypatch):
    real = check.survey

    def survey(*arguments):
        found = real(*arguments)
        with resume(root, cameras=True) as writer:
            record_one(writer, cameras=True)
        return found

    monkeypatch.setattr(check, "survey", survey)
    assert check_report(root) == []
