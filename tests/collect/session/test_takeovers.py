"""What is recorded of a person beside a policy: who owned what in each frame, and every command opens it."""

import csv
import io
import json
import re
from contextlib import closing
from typing import Any

import numpy as np
import pytest
from canned import canned, copied
from command_helpers import ran, refused
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from takeover_helpers import CONFIG, FPS, FRAMES, NONE, PAUSED, expected_owners, record_takeovers

from handrail.collect.commands.replay import replay_episode
from handrail.collect.session.build import build_env, session_features
from handrail.controllers.interface.command import Diagnostics
from handrail.controllers.interface.intent import Intent, RawInput
from handrail.controllers.interface.sources import PERSON, POLICY, Intents, IntentSource
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import read_manifest
from handrail.datasets.format.schema import check_frame
from handrail.datasets.reading.check import check_report
from handrail.datasets.reading.reader import read_episodes, read_frames, read_info
from handrail.datasets.recording.frames import COLUMNS, SHARED_COLUMNS, Frame, frame_features, frame_row
from handrail.datasets.recording.writer import EpisodeWriter

SHARED = [column.name for column in SHARED_COLUMNS]


@pytest.fixture(scope="module")
def takeovers():
    return canned(record_takeovers)


def test_owners_are_those_who_drove(takeovers):
    names = read_info(takeovers).features["owner"].names
    assert names == read_info(takeovers).features["teleop.values"].names
    expected = expected_owners(names)
    for episode in range(2):
        frames = read_frames(takeovers, episode)
        assert np.array_equal(frames["owner"], expected)
        assert np.array_equal(frames["intervention"], (expected == 2).any(axis=1))
        assert np.array_equal(frames["teleop.mask"][:, :-1], expected[:, :-1] > 0)
        assert replay_episode(takeovers, episode)[0].largest == 0.0


def test_the_policy_s_intent_is_kept_also_where_the_person_drove(takeovers):
    frames, names = read_frames(takeovers, 0), read_info(takeovers).features["owner"].names
    answered = np.array([frame not in (*NONE, *PAUSED) for frame in range(FRAMES)])
    wanted, gripper = np.isin(names, "ee.vx") * 0.05 * answered[:, None], 0.25 * answered
    np.testing.assert_allclose(frames["policy.values"][:, :-1], wanted[:, :-1], rtol=1e-6)
    np.testing.assert_allclose(frames["policy.values"][:, -1], gripper)
    np.testing.assert_allclose(
        frames["policy.age"][: PAUSED.start], 0.01 * np.arange(PAUSED.start), rtol=1e-5
    )
    assert not frames["policy.age"][~answered].any()


def test_without_a_policy_nothing_is_added(tmp_path):
    record_takeovers(tmp_path / "set", 1, shared=False)
    assert not {*SHARED} & {*read_info(tmp_path / "set").features}
    with closing(build_env(CONFIG, FPS)) as env:
        plain, shared = session_features(env), session_features(env, shared=True)
    assert list(shared) == [*plain, *SHARED]
    assert {column.name for column in COLUMNS} == set(plain)


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize("of_policy", [True, False])
def test_no_shared_column_is_ever_infinite(number, of_policy):
    """Whichever of both says it, and where its intent is made by hand."""
    good, mask = Intent(np.ones(3), np.array([True, False, True])), np.array([True, True, False])
    bad = Intent(np.full(3, number), mask, (number,), raw=RawInput(age=number))
    one, other = (bad, good) if of_policy else (good, bad)
    both = Intents.of([IntentSource(POLICY, one), IntentSource(PERSON, other)], (number,), other)
    still = np.zeros(2)
    for intent in (both, bad):
        frame = Frame(still, np.zeros(1), {}, intent, still, still, Diagnostics(), 0, False, False, 0.0, 0)
        features = frame_features("ab", "e", "a", ("base.vx", "ee.vx", "joint.a"), shared=True)
        row = check_frame(frame_row(frame, features), features)
        assert all(np.isfinite(row[name]).all() for name in SHARED)
        assert row["owner"].any() == row["intervention"] == intent.is_finite  # else nobody is listened to


EDITS = {
    "delete": "delete SET --episodes 1 --output NEW",
    "keep": "keep SET --episodes 1 --output NEW",
    "split": "split SET --parts part=0.5 --output NEW",
    "trim": "trim SET --output NEW",
    "pack": "pack SET --output NEW",
    "merge": "merge SET MORE --output NEW",
}


@pytest.mark.parametrize("edit", EDITS)
def test_edits_keep_the_columns(edit, takeovers, tmp_path):
    more, new = copied(tmp_path / "more", record_takeovers), tmp_path / "new"
    places = {"SET": takeovers, "NEW": new, "MORE": more}
    verb, *words = EDITS[edit].split()
    ran(*(places.get(word, word) for word in words), name=verb)
    new = new / "part" if edit == "split" else new
    assert check_report(new) == []
    whole = read_frames(takeovers, 0, SHARED)
    for row in read_episodes(new):
        kept = read_frames(new, row["episode_index"], SHARED)
        first = row.get("trimmed_start") or 0
        for name in SHARED:
            assert np.array_equal(kept[name], whole[name][first:][: row["length"]]), name
    opened = LeRobotDataset("handrail/set", root=new)
    item: Any = opened[7]
    assert item["owner"].shape == read_info(new).features["owner"].shape


def test_a_demonstration_beside_take_overs_says_that_its_operator_drove(takeovers, tmp_path):
    plain = canned(record_takeovers, 1, shared=False)
    for order in ((takeovers, plain), (plain, takeovers)):
        new = tmp_path / f"new{len(list(tmp_path.iterdir()))}"
        ran(*order, "--output", new, name="merge")
        assert check_report(new) == []
        number = 2 if order[0] is takeovers else 0
        frames = read_frames(new, number)
        assert np.array_equal(frames["owner"], 2 * frames["teleop.mask"])
        assert not frames["intervention"].any()
        assert not np.any(frames["policy.values"])
        kept = read_frames(new, 0 if number else 1)
        assert np.array_equal(kept["owner"], read_frames(takeovers, 0)["owner"])
        assert replay_episode(new, number)[0].largest == 0.0
        stats = LeRobotDataset("handrail/set", root=new).meta.stats["owner"]
        assert stats["count"][0] == 3 * FRAMES


def test_going_on_needs_the_same_columns(tmp_path):
    root = copied(tmp_path / "set", record_takeovers, 1)
    manifest = read_manifest(Layout(root))
    with EpisodeWriter.resume(root, manifest) as writer:
        assert {*SHARED} < {*writer.features}
    words = "--task", "reach", "--no_physics", "--resume"
    refused(root, *words, told="feature 'owner' of the existing episodes is int64")


def test_a_card_has_the_measures(tmp_path):
    root = copied(tmp_path / "set", record_takeovers)
    ran(root, "--dataset.repo_id", "me/set", name="push")
    assert "interventions" in (root / "README.md").read_text()


def test_take_overs_are_printed_and_compared(takeovers, tmp_path):
    assert re.search(r"^0 +3\.00 +100 +0\.267 ", ran(takeovers, "--check", name="inspect"), re.MULTILINE)
    plain = canned(record_takeovers, 1, shared=False)
    assert "taken over" not in ran(plain, name="inspect")
    ran(takeovers, plain, "--labels", "beside", "alone", "--output", tmp_path, name="compare")
    page, rows = (tmp_path / "report.html").read_text(), (tmp_path / "episodes.csv").read_text()
    assert "interventions a minute" in page
    assert [row["intervention_rate"] for row in csv.DictReader(io.StringIO(rows))] == ["100.0", "100.0", ""]
    values = json.loads((tmp_path / "report.json").read_text())["values"]
    shares = {each["group"]: each["estimate"] for each in values if each["metric"] == "intervention_share"}
    assert shares == {"beside": pytest.approx(16 / FRAMES), "alone": None}
