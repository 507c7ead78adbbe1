"""Looks that are drawn anew are the seed's, are drawn again, and change no number."""

import json

import av
import numpy as np
import pytest
from canned import canned, record_by_command
from collect_helpers import action
from command_helpers import ran, refused

from handrail.collect.config import DatasetConfig, RecordConfig, SessionConfig
from handrail.collect.session.build import build_env
from handrail.controllers.errors import HandrailError
from handrail.datasets.reading.reader import read_episodes

SEEN = {"cameras": "front,wrist", "image_size": 64}
LINE = "--task pick_place --dataset.num_episodes 2 --time_limit 0.5 --randomise"


def episodes(seeds=(1, 2), steps=4, moved=0.0, **settings):
    """Return what is observed in episodes, one after the other, and the last one's model."""
    env = build_env(SessionConfig(**({"task": "pick_place"} | SEEN | settings)), 20, moved=moved)
    found = []
    for seed in seeds:
        found.append(env.reset(seed=seed)[0])
        found += [env.step(action(env, 0.1))[0] for _ in range(steps)]
    model = env.simulation.mujoco_model
    env.close()
    return found, model


def numbers(found):
    return np.array([[*seen["agent_pos"], *seen["environment_state"]] for seen in found])


def apart(some, others):
    """Return how far pictures are apart at least [levels], on average over the pixels."""
    pairs = [
        (one["pixels"][name], other["pixels"][name])
        for one, other in zip(some, others, strict=True)
        for name in one["pixels"]
    ]
    return min(np.abs(one.astype(int) - other).mean() for one, other in pairs)


@pytest.mark.needs_gl
def test_the_seed_alone_says_how_an_episode_looks():
    first, again = episodes((5, 1))[0], episodes((1, 5), randomise=True)[0]
    once = episodes((3, 1, 5), randomise=True)[0]
    assert apart(once[5:], again) == 0.0
    assert apart(again[:5], again[5:]) > 10.0
    assert apart(first, [*again[5:], *again[:5]]) > 10.0


@pytest.mark.needs_gl
@pytest.mark.parametrize("task", ["reach", "pick_place"])
@pytest.mark.parametrize("looks", [{"randomise": True}, {"moved": 2.0}])
def test_every_number_is_what_it_is_without(task, looks):
    usual, other = episodes(task=task)[0], episodes(task=task, **looks)[0]
    np.testing.assert_array_equal(numbers(usual), numbers(other))
    assert apart(usual, other) > 0.5


@pytest.mark.needs_gl
def test_colours_of_goals_stay_recognisable():
    for seed in range(8):
        (_, model), (_, usual) = (
            episodes((seed,), 0, task="reach", randomise=drawn) for drawn in (True, False)
        )
        marker = model.geom_bodyid == model.body("goal").id
        drawn, known = (each.geom_rgba[marker, :3] for each in (model, usual))
        distances = np.linalg.norm(drawn[:, None] - known, axis=2)
        assert np.array_equal(distances.argmin(axis=1), np.arange(6))  # each is nearest to its own
        around = (model.geom_bodyid != 0) & ~marker
        assert np.abs(model.geom_rgba[around] - usual.geom_rgba[around]).mean() > 0.05


@pytest.mark.needs_gl
def test_moved_cameras_are_as_far_away_as_is_said():
    usual = episodes((4,), 0)[1]
    ways = []
    for size in (1.0, 3.0):
        model = episodes((4,), 0, moved=size)[1]
        away = model.cam_pos - usual.cam_pos
        np.testing.assert_allclose(np.linalg.norm(away, axis=1), 0.02 * size)
        cosines = np.abs((model.cam_quat * usual.cam_quat).sum(axis=1))
        np.testing.assert_allclose(2 * np.arccos(cosines), np.deg2rad(3.0 * size), rtol=1e-6)
        np.testing.assert_array_equal(model.cam_fovy, usual.cam_fovy)
        np.testing.assert_array_equal(model.geom_rgba, usual.geom_rgba)
        ways.append(away / size)
    np.testing.assert_allclose(*ways, atol=1e-9)  # the seed says which way
    assert np.linalg.norm(episodes((5,), 0, moved=1.0)[1].cam_pos - model.cam_pos) > 0.02


@pytest.mark.needs_gl
def test_a_recording_says_it_and_pictures_that_come_later_are_the_same(tmp_path):
    blind = canned(record_by_command, LINE)
    at_once = canned(record_by_command, f"{LINE} --cameras front --image_size 64")
    assert all(json.loads(row["settings"])["randomise"] for row in read_episodes(blind))
    eyes = ("--cameras", "front", "--image_size", 64)
    ran(blind, "--output", tmp_path / "later", *eyes, name="render")
    for one, other in zip(films(at_once), films(tmp_path / "later"), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.needs_gl
def test_pictures_of_an_older_dataset_may_be_drawn_anew(tmp_path):
    plain = canned(record_by_command, LINE.removesuffix(" --randomise"))
    eyes = ("--cameras", "front", "--image_size", 64)
    ran(plain, "--output", tmp_path / "anew", *eyes, "--randomise", name="render")
    drawn = canned(record_by_command, f"{LINE} --cameras front --image_size 64")
    for one, other in zip(films(tmp_path / "anew"), films(drawn), strict=True):
        np.testing.assert_array_equal(one, other)
    assert all(json.loads(row["settings"])["randomise"] for row in read_episodes(tmp_path / "anew"))
    refused(plain, "--output", tmp_path / "anew", *eyes, name="render", told="expected episodes of")


def films(root):
    """Return the pictures of a dataset's films, in order."""
    for path in sorted(root.rglob("*.mp4")):
        with av.open(str(path)) as container:
            yield from (frame.to_ndarray(format="rgb24") for frame in container.decode(video=0))


def test_it_is_refused_where_nothing_is_drawn():
    with pytest.raises(HandrailError, match="--no_physics: expected"):
        SessionConfig(task="reach", physics=False, randomise=True).check()
    where, lekiwi = DatasetConfig(place="x"), {"robot": "lekiwi", "robot_client": "lekiwi"}
    config = RecordConfig(**lekiwi, operator="keyboard", task="reach", dataset=where, randomise=True)
    with pytest.raises(HandrailError, match="--robot_client lekiwi: expected none of"):
        config.check()
