"""The actor in plain arrays: the same as the network that was trained, safe to load, as good as said."""

import json

import numpy as np
import pytest
from rl_helpers import random_actor

from handrail.controllers.errors import HandrailError
from handrail.policies.rl.observation import conditioning
from handrail.policies.rl.policy import SHIPPED, Actor
from handrail.scripts.bench.rl.env import FINAL_SEED, evaluate, evaluation_goals


def test_a_file_gives_the_same_actor_back(tmp_path):
    actor = random_actor()
    actor.save(tmp_path / "actor.npz")
    read = Actor.load(tmp_path / "actor.npz")
    observation = np.random.default_rng(1).normal(size=54)
    assert np.array_equal(read(observation), actor(observation))


def test_the_mean_of_actors_lies_between_them():
    """Law: in a single layer the mean's action before tanh is the mean of theirs."""
    rng = np.random.default_rng(3)
    pair = [Actor((rng.normal(size=(3, 54)),), (rng.normal(size=3),)) for _ in range(2)]
    observation = rng.normal(scale=0.1, size=54)
    expected = np.mean([np.arctanh(actor(observation)) for actor in pair], axis=0)
    assert np.allclose(np.arctanh(Actor.mean(pair)(observation)), expected, atol=1e-3)


def test_actions_stay_in_range():
    rng = np.random.default_rng(2)
    actions = np.array([random_actor()(rng.normal(scale=100.0, size=54)) for _ in range(50)])
    assert actions.shape == (50, 3)
    assert np.all(np.abs(actions) <= 1.0)


@pytest.mark.parametrize("spoil", ["text", "missing", "cut", "nan", "pickle"])
def test_what_is_no_actor_is_refused(tmp_path, spoil):
    path, actor = tmp_path / "actor.npz", random_actor()
    weights, biases = list(actor.weights), list(actor.biases)
    arrays = {f"weight_{i}": value for i, value in enumerate(weights)}
    arrays |= {f"bias_{i}": value for i, value in enumerate(biases)}
    if spoil == "nan":
        arrays["bias_1"] = np.full(8, np.nan)
    elif spoil == "cut":
        arrays["weight_1"] = arrays["weight_1"][:, :-1]
    elif spoil == "pickle":
        arrays["bias_1"] = np.array([{}] * 8, dtype=object)
    if spoil == "text":
        path.write_text("an actor")
    elif spoil != "missing":
        np.savez(path, **arrays)
    with pytest.raises(HandrailError, match="actor"):
        Actor.load(path)


def test_plain_arrays_act_like_the_trained_network():
    """Law: the numpy forward pass is Stable-Baselines3's deterministic action."""
    sac = pytest.importorskip("stable_baselines3").SAC
    from handrail.scripts.bench.rl.env import GoalReachingEnv

    env = GoalReachingEnv()
    P = conditioning()
    model = sac("MlpPolicy", env, policy_kwargs={"net_arch": [32, 16]}, buffer_size=10, seed=0, device="cpu")
    actor = Actor.from_state({name: value.numpy() for name, value in model.actor.state_dict().items()}, P)
    observation, _ = env.reset(seed=0)
    for _ in range(30):
        expected, _ = model.predict((P @ observation).astype(np.float32), deterministic=True)
        assert np.allclose(actor(observation), expected, atol=1e-5)
        observation, *_ = env.step(env.action_space.sample())


def test_the_record_is_the_actor_s():
    """Law: what the record says of goals reached is true of goals drawn in the same way."""
    record = json.loads((SHIPPED / "actor.json").read_text())
    said = record["final"]
    scores = evaluate(Actor.load(), evaluation_goals(20, FINAL_SEED), record["settings"]["physics"])
    assert said["success"]["mean"] >= 0.9
    assert sum(score["success"] for score in scores) >= 18
    lengths = [score["length"] for score in scores]
    assert said["length"]["min"] <= min(lengths)
    assert max(lengths) <= said["length"]["max"]
