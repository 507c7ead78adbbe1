"""Laws of the poses that are kept of an episode: what a page plays is what was; old ones make room."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from cockpit_helpers import ask, server
from collect_helpers import environment

from handrail.collect.cockpit import stage
from handrail.collect.cockpit.episodes import EpisodeList, EpisodePoses
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.session.outcome import Tally


@pytest.fixture
def env():
    with environment("Reach") as made:
        made.reset(seed=3)
        yield made


def read(data, bodies):
    """Return a file's header, and its times and poses."""
    length = int.from_bytes(data[:4], "little")
    rows = np.frombuffer(data[4 + length :], "<f4").reshape(-1, 1 + 7 * bodies)
    return json.loads(data[4 : 4 + length]), rows[:, 0], rows[:, 1:]


def drive(env, poses, numbers):
    """Move the robot; return the poses at each frame, by number."""
    seen = {}
    for number in numbers:
        env.step(np.append(np.full(env.model.size, 0.1), 0.0))
        data = env.simulation.data
        poses.see(number, data)
        seen[number] = np.hstack([data.xpos, data.xquat]).ravel().astype("f4")
    return seen


def test_playback_shows_every_tenth_of_a_second(env):
    model = env.simulation.mujoco_model
    poses = EpisodePoses(model)
    seen = drive(env, poses, range(9))
    header, times, rows = read(poses.file(), model.nbody)
    assert header["shapes"] == json.loads(json.dumps(stage.shapes(model)))
    assert header["meshes"] == stage.meshes(model)[0]
    np.testing.assert_allclose(np.diff(times), 0.1, atol=1e-5)
    np.testing.assert_array_equal(rows, [seen[number] for number in range(0, 9, 2)])


def test_undone_frames_are_not_played(env):
    model, poses = env.simulation.mujoco_model, EpisodePoses(env.simulation.mujoco_model)
    drive(env, poses, range(4))
    mark = env.checkpoint()
    gone = drive(env, poses, range(4, 12))
    env.restore(mark)
    drive(env, poses, range(4, 6))
    _, times, rows = read(poses.file(), model.nbody)
    assert np.all(np.diff(times) > 0.0)
    assert times[-1] == pytest.approx(0.05 * 5, abs=0.051)
    assert not any(np.array_equal(row, gone[number]) for row in rows for number in range(6, 12))


def outcome(ended_by=None):
    done = {"is_success": True, "failure_reason": ""}
    return Tally(0, 0.05).outcome(done, ended_by)


def test_old_ones_make_room():
    files, poses = {}, SimpleNamespace()
    listed = EpisodeList(SimpleNamespace(keep=files.__setitem__, drop=files.__delitem__))

    def add(number, size):
        poses.file = lambda: bytes([number]) * size
        listed.add(outcome(), poses)
        return listed.described()[-1]["played"]

    names = [add(number, 100) for number in range(60)]
    assert len(set(names)) == 60
    assert list(files) == names[-50:]
    assert [each["played"] for each in listed.described()] == [""] * 10 + names[-50:]
    large = [add(number, 30 * 2**20) for number in range(4)]
    assert list(files) == large[-2:]


def test_a_discarded_episode_is_told_and_not_kept():
    files = {}
    listed = EpisodeList(SimpleNamespace(keep=files.__setitem__, drop=files.__delitem__))
    listed.add(outcome(EpisodeEvent.DISCARD), None)
    assert (listed.saved, listed.succeeded, files) == (0, 0, {})
    assert [each["kept"] for each in listed.described()] == [False]


def test_why_an_episode_failed_is_said_in_words():
    files = {}
    listed = EpisodeList(SimpleNamespace(keep=files.__setitem__, drop=files.__delitem__))
    listed.add(replace(outcome(EpisodeEvent.DISCARD), success=False, failure_reason="tray_dropped"), None)
    assert [each["said"] for each in listed.described()] == ["tray dropped"]


def test_pages_get_them_as_they_get_meshes():
    with server() as served:
        served.keep("an-episode.bin", b"poses")
        assert ask(served, "/played/an-episode.bin")[0] == 200
        assert ask(served, "/played/an-episode.bin", Origin="http://elsewhere")[0] == 403
        assert ask(served, "/played/nothing.bin")[0] == 403
        served.drop("an-episode.bin")
        assert ask(served, "/played/an-episode.bin")[0] == 403
