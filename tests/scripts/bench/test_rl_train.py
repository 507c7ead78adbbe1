"""Training: a run can be stopped and resumed, its settings stay, and what it writes can be used."""

import json
import os
import signal
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from rl_helpers import TINY_RL

from handrail.controllers.errors import HandrailError
from handrail.policies.rl.policy import Actor
from handrail.scripts.bench.rl import env
from handrail.scripts.bench.rl.env import FINAL_SEED, GoalReachingEnv, evaluate, evaluation_goals, means

pytest.importorskip("stable_baselines3")
pytest.importorskip("tensorboard")
from handrail.scripts.bench.rl.checkpoint import Learner
from handrail.scripts.bench.rl.train import environment, train


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run of 60 steps, stopped and resumed to 100."""
    config = replace(TINY_RL, output_dir=str(tmp_path_factory.mktemp("runs") / "rl"))
    train(config)
    first = Actor.load(config.folder / "actor.npz")
    record = train(replace(config, steps=100, resume=True, learning_rate=2e-4))
    return config, first, record


def test_a_resumed_run_goes_on_where_it_stopped(run):
    config, first, record = run
    assert [row["steps"] for row in record["curve"]] == [40, 60, 80, 100]
    assert record["curve"][-1]["updates"] == 100 - config.random_steps
    assert [row["learning_rate"] for row in record["curve"]] == [1e-4, 1e-4, 2e-4, 2e-4]
    seconds = [row["seconds"] for row in record["curve"]]
    assert seconds == sorted(seconds)
    assert not np.array_equal(Actor.load(config.folder / "actor.npz").weights[0], first.weights[0])


def test_a_resumed_run_remembers_learns_at_the_new_rate_and_meets_new_goals(run):
    config = replace(run[0], learning_rate=2e-4)
    model = Learner.resumed(config, environment(config))
    for optimizer in (model.actor.optimizer, model.critic.optimizer):
        assert optimizer.param_groups[0]["lr"] == 2e-4
    buffer = model.replay_buffer
    assert buffer is not None
    assert (buffer.pos, buffer.full) == (100, False)
    first, resumed = (buffer.observations[place, 0] for place in (0, 60))
    assert not np.allclose(first[30:42], resumed[30:42])  # the goal


def test_a_run_may_start_from_the_networks_of_another(run, tmp_path):
    """Law: before any update the new run's actor is the last one of the other."""
    config, *_ = run
    other = replace(TINY_RL, output_dir=str(tmp_path / "rl"), start_from=config.output_dir, steps=20)
    train(other)
    pair = Actor.load(other.folder / "actor.npz"), Actor.load(config.folder / "actors" / "00000100.npz")
    assert all(np.array_equal(*weights) for weights in zip(*(actor.weights for actor in pair), strict=True))
    with pytest.raises(HandrailError, match="--start_from: expected a run with a checkpoint"):
        train(replace(other, start_from=str(tmp_path / "nothing"), output_dir=str(tmp_path / "another")))


def test_the_record_says_how_the_actor_was_made(run):
    config, _, record = run
    assert json.loads((config.folder / "actor.json").read_text()) == json.loads(json.dumps(record))
    assert record["settings"]["seed"] == config.seed
    assert {"stable-baselines3", "torch", "python", "handrail"} <= set(record["versions"])
    assert record["hardware"]["threads"] == 1
    last = Actor.load(config.folder / "actor.npz")
    score = means(evaluate(last, evaluation_goals(config.goals)))  # the mean of one actor is that actor
    assert {name: record["curve"][-1][name] for name in score} == score
    final = evaluate(last, evaluation_goals(2, FINAL_SEED))
    assert record["final"]["length"]["max"] == max(score["length"] for score in final)
    assert record["final"]["length"]["mean"] == means(final)["length"]


def test_the_same_seed_gives_the_same_actor(run, tmp_path):
    again = replace(TINY_RL, output_dir=str(tmp_path), steps=40)
    train(again)
    actors = [Actor.load(each.folder / "actors" / "00000040.npz") for each in (run[0], again)]
    assert all(np.array_equal(*pair) for pair in zip(*(actor.weights for actor in actors), strict=True))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({}, "there is something already"),
        ({"resume": True, "tau": 0.5}, "--resume with --tau 0.5: expected 0.001"),
        ({"resume": True, "layers": (8,)}, "--layers"),
        ({"resume": True, "physics": False}, "--physics"),
    ],
)
def test_a_run_is_not_spoiled_by_accident(run, change, message):
    with pytest.raises(HandrailError, match=message):
        train(replace(run[0], **change))
    assert Actor.load(run[0].folder / "actor.npz")


def test_the_actor_may_be_the_mean_of_the_last_ones(run):
    config, *_ = run
    train(replace(config, steps=100, resume=True, average=2))
    last = [Actor.load(config.folder / "actors" / f"{steps:08d}.npz") for steps in (80, 100)]
    found = Actor.load(config.folder / "actor.npz")
    assert np.allclose(found.weights[0], (last[0].weights[0] + last[1].weights[0]) / 2)


def test_without_a_checkpoint_nothing_is_resumed(tmp_path):
    with pytest.raises(HandrailError, match="expected a run with a checkpoint"):
        train(replace(TINY_RL, output_dir=str(tmp_path), resume=True))


@pytest.mark.parametrize("name", ["steps", "tau", "layers", "seed", "repeat_missed"])
def test_settings_that_make_no_sense_are_refused(name):
    bad = {"layers": (), "seed": -1, "repeat_missed": 1.5}.get(name, 0)
    with pytest.raises(HandrailError, match=f"--{name}.*expected"):
        replace(TINY_RL, **{name: bad}).check()


@pytest.mark.parametrize(("at", "steps"), [("step", 30), ("evaluation", 40)])
def test_an_interrupted_run_saves_a_checkpoint_and_goes_on(at, steps, tmp_path, monkeypatch):
    """SIGTERM comes before the first evaluation, or during it; no evaluation is waited for."""
    config, calls = replace(TINY_RL, output_dir=str(tmp_path / "rl"), goals=2, steps=50), Counter[str]()

    def counted(name, call):
        def called(*arguments):
            calls[name] += 1
            if name == at and calls[name] == {"step": 30, "evaluation": 1}[at]:
                os.kill(os.getpid(), signal.SIGTERM)
            return call(*arguments)

        return called

    with monkeypatch.context() as patch:
        patch.setattr(GoalReachingEnv, "step", counted("step", GoalReachingEnv.step))
        patch.setattr(env, "run_episode", counted("evaluation", env.run_episode))
        with pytest.raises(KeyboardInterrupt, match=f"interrupted; --resume goes on after step {steps}$"):
            train(config)
    assert calls["evaluation"] == (at == "evaluation"), "it evaluates on"
    assert Learner.resumed(config, environment(config)).num_timesteps == steps
    record = train(replace(config, resume=True))
    assert [row["steps"] for row in record["curve"]] == ([40, 50] if at == "step" else [50])
    assert record["updates"] == 29  # the interrupted step makes none
