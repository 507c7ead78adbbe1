"""A goal for each of two hands: both are in reach at once, and both hands have to be at theirs."""

from dataclasses import replace

import numpy as np
import pytest

from handrail.collect.config import SessionConfig
from handrail.collect.seeds import episode_seed
from handrail.collect.session.build import build_env, build_session
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.robot.inverse_kinematics import hands_configuration


@pytest.fixture(scope="module", params=["left", "right"])
def env(request):
    with build_env(
        SessionConfig(task="reach_both", robot="tiago_pro", mode="both", hand=request.param), 20
    ) as env:
        yield env


def goals(env):
    """Return the hands' goals, in the description's order."""
    state = env.task_state()
    own, other = state.goal, state.pose("other_goal")
    return [own, other] if state.hand == 0 else [other, own]


def test_both_goals_are_in_reach_at_once(env):
    model, home, spread = env.model, env.model.description.home, []
    for seed in range(10):
        env.reset(seed=seed)
        found, rng = False, np.random.default_rng(seed)
        middle = np.mean([goal.position for goal in goals(env)], axis=0)
        spread.append(middle)
        for _ in range(400):  # places of the base, heights of the torso, postures to begin with
            q = home + rng.uniform(-1.0, 1.0, model.size)
            angle = rng.uniform(-np.pi, np.pi)
            q[:3] = [*(middle[:2] - rng.uniform(0.3, 0.9) * np.array([np.cos(angle), np.sin(angle)])), angle]
            q, error = hands_configuration(model, q, goals(env))
            clear = CollisionModel(model).values(q[None]).min() > 0.0
            if found := bool(error < 0.05 and clear):
                break
        assert found, seed
    assert (np.ptp(spread, axis=0)[:2] > 0.8).all()


def test_success_is_both_hands_at_their_goals(env):
    env.reset(seed=3)
    state, there = env.task_state(), tuple(goals(env))
    task, home = env.task, state.tools

    def success(*tools):
        return task.outcome(replace(state, tools=tools)).success

    assert success(*there)
    assert not success(*there[::-1])
    assert not success(there[0], home[1])
    assert not success(home[0], there[1])
    np.testing.assert_allclose(task.features(state)[:3], goals(env)[state.hand].position)


def test_a_person_brings_one_hand_after_the_other(env):
    config = SessionConfig(task="reach_both", robot="tiago_pro", mode="both", hand=env.model.hand.name)
    outcome = build_session(config, env).run(1)
    assert outcome.success
    assert outcome.contact_onsets == 0


@pytest.mark.parametrize("hand", ["left", "right"])
def test_arms_of_five_joints_reach_both(hand):
    config = SessionConfig(task="reach_both", robot="bi_so101", mode="both", hand=hand)
    session = build_session(config, build_env(config, 20))
    outcomes = [session.run(episode_seed(1000, number)) for number in (8, 67, 79)]  # one by one they did not
    assert all(outcome.success for outcome in outcomes)
    assert not any(outcome.contact_onsets for outcome in outcomes)
