"""What is recorded: every setting, how each frame ended, contacts by one meaning, finite numbers only."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from canned import canned, record_by_command
from command_helpers import command, ran, refused

from handrail.collect.commands import replay
from handrail.collect.config import SessionConfig
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.session.recorded import recorded_settings, settings_json
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.command import Diagnostics, Status
from handrail.controllers.interface.intent import Intent, RawInput
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import check_frame
from handrail.datasets.quality.summary import summarize
from handrail.datasets.reading import reader
from handrail.datasets.reading.reader import read_episodes, read_frames, read_info
from handrail.datasets.recording.frames import FARTHEST, MOST, Frame, frame_features, frame_row
from handrail.datasets.recording.writer import EpisodeWriter

MASK = "000111000000000000"
TOUCHING = SessionConfig(
    task="reach", mode="direct", moving_obstacles=4, seed=1, time_limit=8.0, human=HumanSettings(delay=0.25)
)
NEW = ("next.success", "next.done")


@pytest.fixture(scope="module")
def touching(tmp_path_factory):
    """An episode in which a robot without protection is hit by what passes, and what was said of it."""
    root = tmp_path_factory.mktemp("touching") / "set"
    words = "--task reach --mode direct --moving_obstacles 4 --seed 1 --time_limit 8 --human.delay 0.25"
    done = command(*words.split(), "--dataset.num_episodes", 1, "--dataset.root", root)
    assert done.returncode == 0, done.stderr
    return root, done.stderr


@pytest.fixture(scope="module")
def masked():
    """Two short episodes with a mask of one's own."""
    words = f"--task reach --mask {MASK} --time_limit 1 --dataset.num_episodes 2"
    return canned(record_by_command, words)


def test_contacts_are_those_that_began_in_record_replay_and_inspect(touching):
    root, said = touching
    (row,), (seen,), frames = read_episodes(root), summarize(root), read_frames(root, 0)
    begun, periods = re.search(r"contacts begun +(\d+), (\d+) periods in contact", said).groups()
    counts = frames["safety.contacts"]
    assert 1 < int(begun) < int(periods) < counts.sum()  # the three meanings differ here
    assert int(begun) == row["contact_onsets"] == seen.contacts == replay.replay_episode(root, 0)[0].contacts
    assert int(periods) == row["contact_periods"] == np.count_nonzero(counts)
    for name in ("replay", "inspect"):
        shown = command("--dataset.root", root, name=name).stdout
        assert re.search(rf"^ *0 .* {begun}( |$)", shown, re.MULTILINE), shown


def test_every_setting_is_kept_and_a_replay_uses_it(touching, monkeypatch):
    root, _ = touching
    assert recorded_settings(read_episodes(root)[0]) == TOUCHING
    built, honest = [], replay.build_env

    def watched(config, *more, **options):
        built.append(config)
        return honest(config, *more, **options)

    monkeypatch.setattr(replay, "build_env", watched)
    assert replay.replay_episode(root, 0)[0].largest == 0.0
    assert [replace(config, time_limit=TOUCHING.time_limit) for config in built] == [TOUCHING]


def test_a_mask_of_ones_own_has_no_mode_s_name(masked):
    rows = read_episodes(masked)
    assert {row["mode"] for row in rows} == {f"mask:{MASK}"} == set(read_frames(masked, 0)["teleop.mode"])
    settings = recorded_settings(rows[0])
    assert (settings.mask, settings.mode, settings.time_limit) == (MASK, "ee", 1.0)
    assert replay.replay_episode(masked, 1)[0].largest == 0.0


def test_settings_of_a_person_that_are_gone_are_passed_over():
    """Older episodes say two numbers more of a person; any other unknown one is a slip."""
    config = SessionConfig(task="reach")
    said = json.loads(settings_json(config))
    said["human"] |= {"inner_error": 0.08, "tremor": 0.003}
    assert recorded_settings({"settings": json.dumps(said)}) == config
    said["human"]["tremr"] = 0.003
    with pytest.raises(HandrailError, match="unknown entry 'tremr'"):
        recorded_settings({"settings": json.dumps(said)})


WHOLE = json.loads(settings_json(SessionConfig()))


WRONG = [
    *({"task": "juggle"}, {"task": 7}, {"robot": 3}, {"noise": "much"}, {"time_limit": float("nan")}),
    *({"human": 5}, {"human": {"delay": -1}}, {"human": {"mood": 1}}, {"seed": True}),
    *({"moving_obstacles": 2.5}, {"colour": "red"}, {"x\ny": 1}, {"time_limit": 10**400}),
]


@pytest.mark.parametrize(
    "settings",
    [
        *("[[[", "7", "[]", "{}", '"text"', "[" * 100_000, '{"task": "reach"}'),
        *(json.dumps(WHOLE | change) for change in WRONG),
    ],
)
def test_settings_that_are_none_or_wrong_are_one_line(settings):
    recorded_settings({"settings": json.dumps(WHOLE)})
    with pytest.raises(HandrailError) as error:
        recorded_settings({"settings": settings})
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(("name", "value"), [("seed", -1), ("robot", "ridgeback_panda")])
def test_an_episode_that_cannot_have_been_recorded_so_is_one_line(name, value, masked, monkeypatch):
    """No seed of a scene; a robot that has more joints than were recorded."""
    (row, _), said = read_episodes(masked), {"seed": value}
    if name != "seed":
        said = {"settings": json.dumps(json.loads(row["settings"]) | {name: value})}
    monkeypatch.setattr(reader, "read_episodes", lambda root: [row | said])
    with pytest.raises(HandrailError, match=r"seed|28 numbers as observation\.state of ridgeback_panda"):
        replay.replay_episode(masked, 0)


def test_a_frame_says_whether_it_is_done_and_well(touching, masked):
    for root in (touching[0], masked):
        for row in read_episodes(root):
            frames = read_frames(root, row["episode_index"], NEW)
            assert frames["next.done"].tolist() == [False] * (row["length"] - 1) + [True]
            assert frames["next.success"].any() == frames["next.success"][-1] == row["success"]


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf, 1e300])
def test_no_column_is_ever_infinite(number):
    """Whatever an operator sends, and however little a controller knows."""
    channels = ("base.vx", "ee.vx", "joint.a")
    bad = np.full(3, number)
    raw = RawInput(bad, age=number, round_trip=number)
    intent = Intent(bad, np.array([True, False, True]), grippers=(number,), raw=raw)
    diagnostics = Diagnostics(Status.INVALID_STATE, slack=abs(number))
    still = np.zeros(2)
    frame = Frame(still, np.zeros(1), {}, intent, still, still, diagnostics, 0, False, False, 0.0, 0, 1)
    row = check_frame(frame_row(frame), frame_features("ab", "e", "a", channels))
    numbers = {key: value for key, value in row.items() if not isinstance(value, str)}
    assert all(np.isfinite(value).all() for value in numbers.values())
    assert numbers["controller.work_distance"] == numbers["controller.smallest_distance"] == FARTHEST
    assert abs(numbers["teleop.values"]).max() in (0.0, MOST)
    near = replace(frame, diagnostics=Diagnostics(work_distance=0.25, smallest_distance=-0.01))
    row = frame_row(near)
    assert (row["controller.work_distance"], row["controller.smallest_distance"]) == (0.25, -0.01)


@pytest.fixture(scope="module")
def older(masked, tmp_path_factory):
    """The same episodes as an earlier Handrail recorded them."""
    root = tmp_path_factory.mktemp("older") / "set"
    info = read_info(masked)
    names = ("timestamp", "frame_index", "episode_index", "index", "task_index", *NEW)
    features = {key: feature for key, feature in info.features.items() if key not in names}
    kept = ("environment", "robot", "operator", "noise", "person", "success", "failure_reason", "seed")
    with EpisodeWriter.create(root, Manifest("handrail/demo", info.fps, info.robot_type, features)) as writer:
        for row in read_episodes(masked):
            columns = read_frames(masked, row["episode_index"], list(features))
            columns["controller.work_distance"][:] = np.inf
            for index in range(row["length"]):
                writer.add_frame({key: values[index] for key, values in columns.items()}, row["tasks"][0])
            writer.save_episode({name: row[name] for name in kept} | {"mode": "ee", "contacts": 0})
    return root


def test_an_older_dataset_is_read_as_before(older, tmp_path):
    assert replay.replay_episode(older, 0)[0].largest == 0.0
    assert [episode.success for episode in summarize(older)] == [False, False]
    for name in ("replay", "inspect"):
        ran("--dataset.root", older, name=name)
    ran(older, older, "--labels", "a", "b", "--output", tmp_path / "report", name="compare")


def test_resuming_an_older_dataset_is_one_clear_line(older):
    before = {path: path.stat().st_mtime_ns for path in older.rglob("*") if path.is_file()}
    words = "of the existing episodes is none, got"
    refused(older, "--task", "reach", "--resume", told=words)
    assert {path: path.stat().st_mtime_ns for path in older.rglob("*") if path.is_file()} == before
