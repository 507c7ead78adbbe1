"""Disturbances' laws: the seed alone decides, they matter, and without them nothing changes."""

from contextlib import closing

import numpy as np
import pytest
from collect_helpers import Motionless, Watcher, action, environment

from handrail.collect.config import SessionConfig
from handrail.collect.operators.operator import View
from handrail.collect.session.build import build_task
from handrail.collect.session.disturbances import DelayedOperator, Pusher, sample_pushes, sample_shifted
from handrail.collect.session.perturbations import DEFAULTS, Perturbation
from handrail.collect.session.session import Session
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.robot import BASE_BODY
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.collect.world.tasks.reach import Reach
from handrail.collect.world.tasks.tray import Tray
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.registry import fitting
from handrail.controllers.robot.model import load_model

MODEL = load_model()


def test_written_values_are_read_back():
    for text in ("none", "push:1", "push:2.5+shift:0.3+delay:4", "camera:2", "blank:1", "camera:1+swap:1"):
        assert Perturbation.parse(text).text == text
    usual = {name: size for name, size in DEFAULTS.items() if name != "blank"}
    assert Perturbation.parse("push+shift+delay+camera+swap").sizes == usual
    with pytest.raises(HandrailError, match="expected blank or swap, got both"):
        Perturbation.parse("blank+swap")
    assert Perturbation.parse(" push + delay:5 ").words == "pushed delayed:5"
    assert Perturbation.parse("camera").words == "camera moved"
    assert Perturbation.parse("none") == Perturbation()


def path(env, seed, disturbances=(), controller=None):
    """Return where a robot that nobody steers goes, (T, s); by default one whose servos just hold."""
    watcher = Watcher()
    controller = controller or DirectController(MODEL, 1.0 / env.fps)
    Session(env, controller, Motionless(), (watcher,), disturbances=disturbances).run(seed)
    return np.array([frame.state for frame in watcher.frames])


def test_pushes_are_the_seed_s():
    first = sample_pushes(7, 90.0)
    for push, again in zip(first, sample_pushes(7, 90.0), strict=True):
        assert (push.start, push.end, push.hand) == (again.start, again.end, again.hand)
        np.testing.assert_array_equal(push.direction, again.direction)
    shorter = sample_pushes(7, 20.0)
    assert [push.start for push in shorter] == [push.start for push in first[: len(shorter)]]
    assert sample_pushes(8, 90.0)[0].start != first[0].start
    pushes = [push for seed in range(50) for push in sample_pushes(seed, 30.0)]
    assert {push.hand for push in pushes} == {True, False}
    assert all(push.direction[2] == 0.0 for push in pushes if not push.hand)
    np.testing.assert_allclose([np.linalg.norm(push.direction) for push in pushes], 1.0)


def test_a_push_moves_the_robot_and_more_strength_moves_it_more():
    """Displacements of the tool by the first push of some seeds, median, at rest."""
    with environment("Reach") as env:
        moved = {}
        for size in (0.0, 1.0, 2.0):
            away = []
            for seed in range(8):
                env.reset(seed=seed)
                pusher, start = Pusher(size), env.simulation.tools[0].position
                pusher.begin(env, seed)
                while env.simulation.data.time < sample_pushes(seed, 30.0)[0].end + 0.5:
                    pusher.act()
                    env.step(action(env))
                assert not env.simulation.data.xfrc_applied.any()
                away.append(np.linalg.norm(env.simulation.tools[0].position - start))
            moved[size] = float(np.median(away))
    assert moved[0.0] < 0.035  # the servos nearly hold
    assert 0.02 < moved[1.0] < 0.3
    assert moved[2.0] > 1.5 * moved[1.0]


def test_the_mpc_holds_against_a_push_as_the_servos_alone_do():
    """A plan that went on from what is measured would give way, and then coast to rest."""
    controller, moved = MaskedMpc(MODEL), []
    with environment("Reach", task=Reach(time_limit=4.0)) as env:
        for seed in range(4):
            held, planned = (path(env, seed, (Pusher(1.0),), who)[:, :9] for who in (None, controller))
            moved.append([np.abs(way - way[0]).max() for way in (held, planned)])
    held, planned = np.array(moved).T
    assert held.max() > 0.02
    assert np.all(planned < 1.2 * held + 0.005)


def test_a_session_without_disturbance_is_what_it_was():
    with environment("Reach", task=Reach(time_limit=3.0)) as env:
        calm, again = path(env, 3), path(env, 3, (Pusher(0.0),))
        pushed, repeated = path(env, 3, (Pusher(1.0),)), path(env, 3, (Pusher(1.0),))
    assert np.abs(calm[:, :9] - calm[0, :9]).max() < 1e-3
    np.testing.assert_array_equal(pushed, repeated)
    assert np.abs(pushed - calm).max() > 0.01
    assert np.abs(again - calm).max() < np.abs(pushed - calm).max()


@pytest.mark.parametrize("task", sorted(fitting(TASKS, 1)))
def test_a_shifted_start_is_elsewhere_and_free(task):
    usual = build_task(SessionConfig(task=task))
    for seed in range(4):
        before = usual.sample(MODEL, np.random.default_rng(seed))
        after, again = (sample_shifted(usual, 0.3, MODEL, np.random.default_rng(seed)) for _ in range(2))
        np.testing.assert_array_equal(after.q, again.q)
        assert 0.1 < np.linalg.norm(after.q[:2] - before.q[:2]) <= 0.3 + 1e-9
        assert np.abs(after.q[2] - before.q[2]) <= 0.3
        for item, there in zip(before.scene.objects, after.scene.objects, strict=True):
            carried = bool(before.grip) and item.movable
            assert np.array_equal(item.position, there.position) != carried
        solid = tuple(item.obstacle() for item in after.scene.objects if not item.ghost)
        near = CollisionModel(MODEL, solid).values(after.q[None])[0]
        assert near.min() > 0.0 or after.grip


def test_a_held_object_keeps_its_place_in_the_hand():
    before = Tray().sample(MODEL, np.random.default_rng(1))
    after = sample_shifted(Tray(), 0.5, MODEL, np.random.default_rng(1))
    for name in ("tray", "can"):
        places = []
        for episode in (before, after):
            hand, item = MODEL.pose(episode.q), episode.scene.find(name)
            places.append(hand.rotation.T @ (item.position - hand.position))
        np.testing.assert_allclose(*places, atol=1e-9)


@pytest.mark.parametrize("periods", [0, 1, 4])
def test_delayed_is_what_was_seen_k_periods_ago(periods):
    with environment("Reach") as env:
        env.reset(seed=0)
        inner = Motionless()
        operator = DelayedOperator(inner, periods)
        views = []
        for _ in range(10):
            views.append(View(env.state(), env.task_state()))
            if len(views) == 1:
                operator.reset(views[0], np.random.default_rng(0))
            intent = operator.act(views[-1])
            assert isinstance(intent, Intent)
            assert intent.time == views[-1].state.time
            env.step(action(env, 0.1))
    assert inner.seen == [views[max(0, step - periods)] for step in range(10)]


def test_of_two_hands_the_one_that_does_the_task_is_pushed_by_its_own_arm_s_torque():
    model = load_model("tiago_pro").with_hand("right")
    pushed: dict[str, float] = {}
    with closing(HandrailEnv(Reach(), model, fps=20)) as env:
        env.reset(seed=0)
        pusher, now = Pusher(1.0), env.simulation.data
        pusher.begin(env, 0)
        for now.time in np.arange(0.0, 15.0, 0.05):
            pusher.act()
            for body in np.flatnonzero(now.xfrc_applied.any(axis=1)):
                force = float(np.linalg.norm(now.xfrc_applied[body, :3]))
                pushed[env.simulation.mujoco_model.body(body).name] = force
    (hand,) = (name for name in pushed if name != BASE_BODY)
    assert "right" in hand
    assert 10.0 < pushed[hand] < 30.0  # N; the torso, which lifts, would hold 2000
