"""Evaluation's laws: paired, the same in parallel, never twice, protected where it says so."""

import json
import os
import re
from dataclasses import replace

import pytest
from policy_helpers import StandIn, checkpoint, killed, load

from handrail.collect.seeds import FIRST_SEED
from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.evaluations import read_evaluations
from handrail.policies.imitation.evaluation.conditions import policy_conditions
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.evaluation import UnevaluatedError, evaluate
from handrail.policies.imitation.evaluation.file import evaluation_table


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Checkpoints by name."""
    root, picks = tmp_path_factory.mktemp("policies"), {"kind": "random", "task": "pick_place"}
    checkpoint(root / "chase")
    checkpoint(root / "chase_1", training_seed=1)
    checkpoint(root / "chase_realised", actions="realised")
    checkpoint(root / "brief", kind="still", time_limit=0.5)
    for kind in ("random", "torch", "nan", "short"):
        checkpoint(root / kind, kind=kind)
    checkpoint(root / "bold", mode="direct", actions="realised", **picks)
    checkpoint(root / "bold_hand", **picks)
    checkpoint(root / "single", mode="direct_single")
    return root


def config(folder, *names, **settings):
    settings = {"episodes": 2, "time_limit": 4.0, "workers": 1} | settings
    return EvaluateConfig(policy=tuple(str(folder / name) for name in names), **settings)


def rollouts(content, label, policy=0):
    return content["arms"][label][policy]["rollouts"]


def untimed(content):
    """Return the content without what the clock says."""
    rows = [row for arm in content["arms"].values() for entry in arm for row in entry["rollouts"]]
    for row in rows:
        del row["timing"]
    return content


def test_seeds_are_never_those_of_a_recording():
    from handrail.collect.seeds import episode_seed

    recorded = [episode_seed(seed, episode) for seed in (0, 1, 10**6) for episode in range(200)]
    assert max(recorded) < FIRST_SEED
    first, second = (EvaluateConfig(seed=seed, episodes=10**6).seeds for seed in (0, 1))
    assert min(first) == FIRST_SEED
    assert max(first) < min(second)


@pytest.mark.slow
def test_parallel_rollouts_are_the_serial_ones(folder, tmp_path):
    how = {"perturbation": "none,push+shift+delay", "time_limit": 2.0}
    both = config(folder, "random", "chase_1", **how)
    serial = evaluate(both, load=load)
    parallel = evaluate(replace(both, workers=2, json=str(tmp_path / "e.json")), load=load)
    assert untimed(parallel) == untimed(serial)
    assert set(serial["arms"]) == {"ee intent", "ee intent pushed shifted delayed"}
    assert untimed(json.loads((tmp_path / "e.json").read_text())) == serial


def test_random_draws_of_a_policy_depend_on_the_seed_alone(folder):
    import torch

    torch.manual_seed(3)
    expected = torch.rand(1)
    torch.manual_seed(3)
    asked = config(folder, "torch", episodes=2, time_limit=0.5)
    first = rollouts(untimed(evaluate(asked, load=load)), "ee intent")
    assert torch.rand(1) == expected  # whoever else draws is not disturbed
    (second,) = rollouts(untimed(evaluate(replace(asked, episodes=1), load=load)), "ee intent")
    assert second == first[0]
    assert first[0]["smallest_distance"] != first[1]["smallest_distance"]


def test_resume_runs_only_what_is_missing(folder, tmp_path):
    file = tmp_path / "e.json"
    asked = config(folder, "chase", json=str(file), time_limit=1.0)
    first = evaluate(asked, load=load)
    assert evaluate(asked, load=pytest.fail) == first
    more = evaluate(replace(asked, policy=(*asked.policy, str(folder / "chase_1")), episodes=3), load=load)
    assert [[row["seed"] for row in entry["rollouts"]] for entry in more["arms"]["ee intent"]] == [
        list(range(FIRST_SEED, FIRST_SEED + 3))
    ] * 2
    assert rollouts(more, "ee intent")[:2] == rollouts(first, "ee intent")
    policies = read_evaluations([file])["ee intent"].policies
    assert [(policy.training_seed, len(policy.rollouts)) for policy in policies] == [(0, 3), (1, 3)]
    assert policies[0].trained_on == {"episodes": 50.0, "operator_time": 312.5}


def test_finished_rollouts_are_kept_when_one_fails(folder, tmp_path):
    class Breaking(StandIn):
        def act(self, state, environment, images, task):
            assert task == "Move the gripper to the goal frame."
            if len(done) == 4:  # made, and begun three times
                raise RuntimeError("broken")
            return super().act(state, environment, images, task)

        def reset(self):
            done.append(1)
            super().reset()

    done = []

    file = tmp_path / "e.json"
    asked = config(folder, "short", json=str(file), episodes=5, time_limit=0.5)
    with pytest.raises(UnevaluatedError, match="RuntimeError: broken"):
        evaluate(asked, load=lambda path: Breaking(load(path).interface, "still"))
    assert len(rollouts(json.loads(file.read_text()), "ee intent")) == 2


@pytest.mark.slow
def test_a_killed_worker_is_one_line_and_the_same_command_goes_on(folder, tmp_path):
    some = config(folder, "short", json=str(tmp_path / "e.json"), time_limit=0.5)
    evaluate(replace(some, episodes=1), load=load)
    with pytest.raises(HandrailError, match=r"\(SIGKILL\), perhaps for want of memory"):
        evaluate(replace(some, episodes=3, workers=2), load=killed)
    assert len(rollouts(evaluate(replace(some, episodes=3), load=load), "ee intent")) == 3


def test_an_intent_meets_the_controller_of_its_mode(folder):
    """What the policy asks for in teleop mode is completed as in teleop: the hand goes to the goal."""
    asked = config(folder, "chase", "chase_realised", protection="own,none", time_limit=12.0)
    content = evaluate(asked, load=load)
    assert set(content["arms"]) == {"ee intent", "ee intent unprotected", "ee"}
    for label in content["arms"]:
        assert all(row["success"] for row in rollouts(content, label)), label
        assert all(row["time_to_success"] == row["length"] for row in rollouts(content, label))
    assert len(evaluation_table(content).rows) == 3


def test_a_rollout_has_the_time_that_the_demonstrations_had(folder):
    """Where nobody says another."""
    for said, length in ((0.0, 0.5), (0.8, 0.8)):
        content = evaluate(config(folder, "brief", episodes=1, time_limit=said), load=load)
        (row,) = rollouts(content, "ee intent")
        assert row["length"] == length
        assert row["failure_reason"] == "timeout"


@pytest.mark.parametrize(("name", "protection"), [("bold", "mpc"), ("bold", "filter"), ("bold_hand", "own")])
def test_protected_policies_touch_nothing_whatever_they_do(folder, name, protection):
    asked = config(folder, name, protection=protection, episodes=2, time_limit=5.0)
    label = policy_conditions(asked)[0][0].label
    for row in rollouts(evaluate(asked, load=load), label):
        assert row["contacts"] == 0
        assert row["smallest_distance"] > 0.0


def test_without_protection_the_same_policy_does_touch(folder):
    content = evaluate(config(folder, "bold", episodes=3, time_limit=5.0), load=load)
    rows = rollouts(content, "direct")
    assert sum(row["contacts"] for row in rows) > 0
    assert all(row["contact_time"] > 0 for row in rows if row["contacts"])


@pytest.mark.parametrize(
    ("name", "protection", "count"),  # every fifth of 40 actions; all, of another size
    [("nan", "own", 8), ("nan", "none", 8), ("short", "own", 40)],
)
def test_unusable_actions_brake_and_are_counted(folder, name, protection, count):
    asked = config(folder, name, protection=protection, episodes=1, time_limit=2.0)
    (row,) = rollouts(evaluate(asked, load=load), policy_conditions(asked)[0][0].label)
    assert row["malformed"] == count <= row["brakes"]
    assert (row["length"], row["failure_reason"]) == (2.0, "timeout")


WRONG = {
    "nobody": ({}, (), "policy: expected one checkpoint folder or more"),
    "no checkpoint": ({}, ("nothing",), "expected a checkpoint with a config.json, found none"),
    "episodes": ({"episodes": 0}, ("chase",), "--episodes: expected a whole number"),
    "protection": ({"protection": "prayer"}, ("chase",), "unknown protection 'prayer'"),
    "perturbation": ({"perturbation": "rain"}, ("chase",), "unknown perturbation 'rain'"),
    "size": ({"perturbation": "push:-1"}, ("chase",), "--perturbation push:-1: expected a number above 0"),
    "half a period": ({"perturbation": "delay:1.5"}, ("chase",), "delay: expected a whole number"),
    "twice": ({"perturbation": "push+push"}, ("chase",), "delay, camera, blank, swap once"),
    "blind": ({"perturbation": "camera"}, ("chase",), "expected a policy that sees pictures"),
    "filter": ({"protection": "filter"}, ("chase",), "or a policy of joint velocities"),
    "rests": ({"protection": "mpc"}, ("single",), "or a policy of joint velocities"),
    "tasks": ({}, ("chase", "bold"), "expected policies of one task, got pick_place, reach"),
    "time limits": ({"time_limit": 0.0}, ("brief", "chase_1"), "evaluate it by another --label"),
    "the same policy": ({}, ("chase", "nan"), "expected each dataset draw and training seed once"),
    "json": ({"json": "no/such/folder/e.json"}, ("chase",), "expected a .json file in an existing folder"),
    "video": ({"video": "film.gif"}, ("chase",), "expected a .mp4 file in an existing folder"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input_is_one_clear_line(case, folder):
    settings, names, words = WRONG[case]
    with pytest.raises(HandrailError, match=re.escape(words)):
        evaluate(config(folder, *names, **settings), load=load)


@pytest.mark.parametrize(("flag", "ending"), [("video", ".mp4"), ("json", ".json")])
def test_a_file_that_cannot_be_written_is_refused_at_once(flag, ending, folder, tmp_path, monkeypatch):
    place = tmp_path / f"there{ending}"
    place.mkdir()
    with pytest.raises(HandrailError, match=f"expected a {ending} file in an existing folder"):
        config(folder, "chase", **{flag: str(place)}).check()
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(HandrailError, match=f"--{flag} .*: expected a folder that can be written, but"):
        config(folder, "chase", **{flag: str(tmp_path / f"free{ending}")}).check()


def test_a_file_of_something_else_is_not_added_to(folder, tmp_path):
    file = tmp_path / "e.json"
    asked = config(folder, "chase", json=str(file), episodes=1, time_limit=0.5)
    evaluate(asked, load=load)
    before = file.read_bytes()
    for other, words in (
        (config(folder, "nan", json=str(file), time_limit=0.5), "has another policy of dataset draw"),
        (config(folder, "bold", json=str(file)), "expected task reach, got pick_place"),
        (replace(asked, time_limit=1.0), "expected {"),
    ):
        with pytest.raises(HandrailError, match=words):
            evaluate(other, load=load)
        assert file.read_bytes() == before
    file.write_text("{}")
    with pytest.raises(HandrailError, match="expected the format"):
        evaluate(asked, load=load)


def test_a_file_put_together_by_hand_is_gone_on_with(folder, tmp_path):
    file = tmp_path / "e.json"
    asked = config(folder, "chase", json=str(file), episodes=3, time_limit=0.5)
    content = evaluate(asked, load=load)
    (entry,) = content["arms"]["ee intent"]
    parts = [entry | {"rollouts": entry["rollouts"][:1]}, entry | {"rollouts": entry["rollouts"][1:]}]
    content["arms"]["ee intent"] = parts
    file.write_text(json.dumps(content))
    evaluate(asked, load=pytest.fail)  # nothing is missing
    more = evaluate(replace(asked, episodes=4), load=load)
    assert len(read_evaluations([file])["ee intent"].rollouts) == 4
    assert evaluation_table(more).rows[0][1] == "1"  # policy


def test_one_command_at_a_time_writes_a_file(folder, tmp_path):
    asked = config(folder, "chase", json=str(tmp_path / "e.json"), episodes=1, time_limit=0.5)

    def another(path):
        with pytest.raises(HandrailError, match="written by another handrail-evaluate"):
            evaluate(replace(asked, episodes=2), load=load)
        return load(path)

    assert len(rollouts(evaluate(asked, load=another), "ee intent")) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["e.json"]
    assert len(rollouts(evaluate(replace(asked, episodes=2), load=load), "ee intent")) == 2


def test_the_same_scenes_under_more_policies_are_no_more_scenes():
    """Three policies that do the same in 100 scenes: the interval of one."""
    rollouts = [{"seed": seed, "success": seed % 3 > 0, "length": 1.0} for seed in range(100)]
    tables = [
        evaluation_table(
            {"arms": {"ee": [{"training_seed": k, "rollouts": rollouts} for k in range(policies)]}}
        )
        for policies in (1, 3)
    ]
    (one,), (three,) = (table.rows for table in tables)
    assert (one[2], three[2]) == ("66/100 = 66%", "198/300 = 66%")
    assert one[3] == three[3] == "56% – 75%"


def test_a_mode_or_rate_that_the_policy_says_itself_is_taken_or_refused(folder):
    said = policy_conditions(config(folder, "chase"))
    assert policy_conditions(config(folder, "chase", mode="ee", fps=20)) == said
    for other, named in (
        ({"mode": "direct"}, "--mode ee, got direct"),
        ({"fps": 30}, "--fps 20, got 30"),
    ):
        with pytest.raises(HandrailError, match=rf"\A--policy .*chase: expected {named}\Z"):
            policy_conditions(config(folder, "chase", **other))
    with pytest.raises(HandrailError, match="--mode my_kit:HAND: expected a policy of it, got ee"):
        policy_conditions(config(folder, "chase", mode="my_kit:HAND"))
    with pytest.raises(HandrailError, match="unknown mode 'dierct'"):
        config(folder, "chase", mode="dierct").check()
    with pytest.raises(HandrailError, match="--fps 5: expected 10 to 100"):
        config(folder, "chase", fps=5).check()
