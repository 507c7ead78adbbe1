"""Policies of plain `lerobot-train` are evaluated, or it is said why not; a bad one stops no other."""

import json
import shutil

import av
import numpy as np
import pytest
from policy_helpers import checkpoint, unable, untrained_act

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.evaluation.conditions import policy_conditions, read_checkpoint
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.evaluation import UnevaluatedError, evaluate, film
from handrail.policies.imitation.interface.checkpoint import NAME, PolicyMeta, read_meta, write_meta


def entry(kind, *shape):
    return {"type": kind, "shape": shape}


FEATURES = {"observation.state": entry("STATE", 26), "observation.environment_state": entry("ENV", 7)}


@pytest.fixture(scope="module")
def honest(tmp_path_factory):
    """A policy that reads and writes what is recorded in `reach`, as lerobot-train leaves it."""
    folder = tmp_path_factory.mktemp("lerobot") / "checkpoints" / "000100" / "pretrained_model"
    untrained_act(folder, "recorded")
    (folder / NAME).unlink()
    (folder / "train_config.json").write_text('{"seed": 1000}')
    return folder


@pytest.fixture
def plain(honest, tmp_path):
    return shutil.copytree(honest, tmp_path / "plain")


def says(folder, **settings):
    """Let a policy say something else of itself."""
    path = folder / "config.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | settings))


def reads(folder, **features):
    says(folder, input_features=features)


def config(*folders, **settings):
    own = {"episodes": 1, "time_limit": 0.5, "workers": 1, "task": "reach", "robot": "ridgeback_ur10"}
    settings = own | settings
    return EvaluateConfig(policy=tuple(map(str, folders)), **settings)


def test_a_policy_of_plain_lerobot_drives(honest):
    content = evaluate(config(honest.parents[2]))  # the training's folder
    assert content["task"] == "reach"
    (entry,) = content["arms"]["act"]
    assert entry["training_seed"] == 1000
    (row,) = entry["rollouts"]
    assert (row["length"], row["malformed"]) == (0.5, 0)
    said = {"robot": "ridgeback_ur10", "fps": "20", "actions": "recorded"}
    assert said.items() <= content["conditions"]["act"].items()


@pytest.mark.parametrize("around", [{}, {"observation.images.wrist": entry("VISUAL", 3, 64, 64)}])
def test_joint_velocities_are_no_intents_of_a_mode_with_as_many_numbers(around, plain):
    """`base+ee` has ten, too: beside a person its name is always said."""
    reads(plain, **FEATURES | around)
    if around:
        reads(plain, **{"observation.state": FEATURES["observation.state"]} | around)
    asked = config(plain, mode="base+ee")
    meta = read_checkpoint(plain, asked).meta
    assert (meta.actions, meta.intent_mode) == ("recorded", "")
    with pytest.raises(HandrailError, match="expected --mode left out"):
        policy_conditions(asked)


def test_an_untrained_act_drives_without_contact_and_repeatably(tmp_path):
    asked = config(*(untrained_act(tmp_path / kind, kind) for kind in ("intent", "realised")), time_limit=1.0)
    first, again = evaluate(asked), evaluate(asked)
    assert set(first["arms"]) == {"ee intent", "ee"}
    for label, arm in first["arms"].items():
        (row,), (repeated,) = arm[0]["rollouts"], again["arms"][label][0]["rollouts"]
        assert row.pop("timing")["policy"] > 0
        del repeated["timing"]
        assert row == repeated
        assert row["length"] == 1.0
        assert row["malformed"] == row["brakes"] == row["contacts"] == 0


@pytest.mark.parametrize(
    ("size", "movers", "task"),
    [(7, 0, "reach"), (19, 2, "reach"), (28, 0, "pick_place"), (29, 0, "tray"), (9, 0, "drawer")],
)
def test_the_features_are_those_of_the_task(size, movers, task, plain):
    reads(plain, **FEATURES | {"observation.environment_state": entry("ENV", size)})
    (condition,), _ = policy_conditions(config(plain, task=task))
    assert condition.checkpoint.movers == movers
    for other in {"drawer", "pick_place", "tray", "reach"} - {task}:
        with pytest.raises(HandrailError, match=f"expected the features of ridgeback_ur10 in {other}"):
            policy_conditions(config(plain, task=other))


def test_robot_and_task_are_said_by_the_dataset_of_the_training(plain, recorded):
    """By flags where it is not there, and never guessed."""
    (plain / "train_config.json").write_text(json.dumps({"dataset": {"root": str(recorded)}}))
    (condition,), _ = policy_conditions(config(plain, task="", robot=""))
    meta = condition.checkpoint.meta
    assert (meta.environment, meta.robot) == ("reach", "ridgeback_ur10")
    (plain / "train_config.json").write_text(json.dumps({"dataset": {"root": "/nowhere", "repo_id": "a/b"}}))
    with pytest.raises(HandrailError, match="expected --robot and --task: neither it nor its dataset says"):
        policy_conditions(config(plain, task="", robot=""))


@pytest.mark.parametrize("fps", [10, 30])
def test_the_rate_is_that_of_the_dataset_of_the_training(fps, plain, recorded, tmp_path):
    root = shutil.copytree(recorded, tmp_path / "set")
    path = root / "meta" / "info.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"fps": fps}))
    (plain / "train_config.json").write_text(json.dumps({"dataset": {"root": str(root)}}))
    (condition,), _ = policy_conditions(config(plain))
    assert condition.checkpoint.meta.fps == fps


def test_a_policy_may_see_pictures_instead_of_the_environment_s_state(plain):
    state = FEATURES["observation.state"]
    reads(plain, **{"observation.state": state, "observation.images.wrist": entry("VISUAL", 3, 64, 64)})
    (condition,), _ = policy_conditions(config(plain, task="tray"))
    assert condition.checkpoint.meta.environment == "tray"
    assert condition.checkpoint.pictures == {"wrist": (64, 64)}


@pytest.mark.parametrize("described", [False, True])
@pytest.mark.parametrize(("size", "mode", "numbers"), [(33, "ee", 7), (54, "switching", 11)])
def test_a_policy_of_lerobot_record_is_driven_with_its_mode(size, mode, numbers, described, plain):
    """There robot and scene are one vector, and an action is the mode's channels.

    Law: whether `lerobot-train` has trained it, or `handrail-train --actions recorded`.
    """
    if described:
        write_meta(plain, PolicyMeta(None, "", "", "robot", 20, "recorded", 0, 0, {}, "act", 1))
    reads(plain, **{"observation.state": entry("STATE", size)})
    says(plain, output_features={"action": entry("ACTION", numbers)})
    with pytest.raises(HandrailError, match=f"'action': {numbers}"):
        policy_conditions(config(plain))
    task = {33: "reach", 54: "pick_place"}[size]
    (condition,), _ = policy_conditions(config(plain, mode=mode, task=task))
    checkpoint = condition.checkpoint
    assert (checkpoint.meta.intent_mode, checkpoint.joined, condition.protection) == (mode, True, "mpc")


@pytest.mark.parametrize(
    ("features", "words"),
    [
        ({"observation.state": entry("STATE", 6)}, "state': 6, .*environment_state': 7, 'action': 10"),
        ({"observation.environment_state": entry("ENV", 8)}, "environment_state': 8"),
        ({"observation.force": entry("STATE", 6)}, "observation.force"),
        ({"observation.images.roof": entry("VISUAL", 3, 64, 64)}, "camera 'roof': expected one of front"),
        ({"observation.images.wrist": entry("VISUAL", 64, 64)}, "expected channels, height and width"),
        ({"observation.state": entry("STATE", 2, 13)}, "expected one dimension"),
        ({"observation.state": entry("STATE", "x")}, "expected a whole number"),
        ({"observation.state": 3}, "input_features: expected a table"),
    ],
)
def test_a_policy_that_cannot_be_evaluated_is_one_line(features, words, plain):
    reads(plain, **FEATURES | features)
    with pytest.raises(HandrailError, match=words):
        evaluate(config(plain))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("policies")
    checkpoint(root / "good")
    checkpoint(root / "good_1", training_seed=1)
    checkpoint(root / "mixed", training_seed=2)
    meta = json.loads((root / "mixed" / NAME).read_text())
    (root / "mixed" / NAME).write_text(json.dumps(meta | {"mode": "mixed"}))
    checkpoint(root / "broken", training_seed=3)
    return root


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_one_bad_policy_is_named_and_the_others_run(workers, folder, tmp_path):
    file = tmp_path / "e.json"
    names = ("nothing", "mixed", "broken", "good", "good_1")
    asked = config(*(folder / name for name in names), json=str(file), workers=workers, episodes=3)
    with pytest.raises(UnevaluatedError) as raised:
        evaluate(asked, load=unable)
    assert [reason.count("\n") for reason in raised.value.reasons] == [0, 0, 0]
    for words in ("found none", "unknown mode 'mixed'", "no weights"):
        assert any(words in reason for reason in raised.value.reasons)
    assert json.loads(file.read_text()) == raised.value.content
    runs = raised.value.content["arms"]["ee intent"]
    assert [(run["training_seed"], len(run["rollouts"])) for run in runs] == [(0, 3), (1, 3)]


@pytest.mark.needs_gl
def test_the_first_policy_that_drove_is_filmed(folder, tmp_path):
    asked = config(folder / "broken", folder / "good", video=str(tmp_path / "film.mp4"))
    with pytest.raises(UnevaluatedError) as raised:
        evaluate(asked, load=unable)
    assert film(asked, raised.value.content, unable) == ""
    with av.open(str(tmp_path / "film.mp4")) as video:
        pictures = [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]
    assert len(pictures) == 10  # of 0.5 s
    assert np.std(pictures[0]) > 10


def test_only_bad_policies_are_bad_input(folder):
    with pytest.raises(HandrailError, match="found none; unknown mode"):
        evaluate(config(folder / "nothing", folder / "mixed"), load=unable)


def test_a_policy_is_read_whatever_its_loss_was(tmp_path):
    """A held-out episode may leave the ranges of the training widely."""
    meta = PolicyMeta(None, "", "", "robot", 20, "recorded", 0, 0, {}, "act", 1, validation={"500": 2e6})
    write_meta(tmp_path, meta)
    assert read_meta(tmp_path) == meta
