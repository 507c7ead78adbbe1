"""Moving obstacles: one motion for physics, controller and observation; the session passes it on."""

from dataclasses import dataclass

import numpy as np
import pytest
from collect_helpers import Motionless, Watcher, action, environment, episode

from handrail.collect.config import SessionConfig
from handrail.collect.session.build import build_env
from handrail.collect.session.session import Session
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.observation import MOST, from_numbers, to_numbers
from handrail.collect.world.scene import Patrol, Scene, SceneObject
from handrail.collect.world.task import Start
from handrail.collect.world.tasks.reach import FASTEST, Reach, sample_movers
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.model import Pose, load_model
from handrail.controllers.robot.shape import Obstacle, Shape

MODEL = load_model()
HOME = MODEL.description.home
PATROL = Patrol([0.0, 1.0, 0.5], [3.0, -3.0, 0.5], 0.5)
DIRECT_AT_THE_BASE = Patrol([-1.4, -2.2, 0.25], [-1.4, 4.0, 0.25], 0.5)


def test_a_patrol_is_the_integral_of_its_velocity():
    times = np.linspace(0.0, 45.0, 901)
    steps = np.diff([PATROL.position(time) for time in times], axis=0)
    expected = [PATROL.velocity(time) * (times[1] - times[0]) for time in 0.5 * (times[1:] + times[:-1])]
    np.testing.assert_allclose(steps, expected, atol=1e-9)
    np.testing.assert_allclose(PATROL.position(0.0), PATROL.start)
    np.testing.assert_allclose(PATROL.position(10.0), PATROL.end)
    np.testing.assert_allclose(PATROL.position(20.0), PATROL.start, atol=1e-12)
    assert np.linalg.norm(PATROL.velocity(17.0)) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("end", "speed"), [([0.0, 1.0, 0.5], 0.5), ([1.0, 0.0, 0.0], 0.0), ([1.0, 0, 0], np.nan)]
)
def test_a_patrol_that_goes_nowhere_is_refused(end, speed):
    with pytest.raises(HandrailError, match="patrol: expected two points and a positive speed"):
        Patrol([0.0, 1.0, 0.5], end, speed)


def test_physics_controller_and_observation_see_the_same():
    with environment("Reach", task=Reach(moving_obstacles=2)) as env:
        observation, _ = env.reset(seed=4)
        for _ in range(30):
            state = env.task_state()
            movers = [item for item in env.obstacles() if item.velocity.any()]
            assert len(movers) == 2
            for item in movers:
                np.testing.assert_allclose(state.pose(item.name).position, item.position, atol=1e-12)
                for axis, place, speed in zip("xy", item.position, item.velocity, strict=False):
                    names = [f"{item.name}.{axis}", f"{item.name}.v{axis}"]
                    seen = observation["environment_state"][[env.state_names.index(name) for name in names]]
                    np.testing.assert_allclose(seen, [place, speed], atol=1e-6)
            observation = env.step(action(env))[0]


def test_goals_are_the_same_with_and_without_and_all_follows_from_the_seed():
    def sample(count, seed):
        return Reach(moving_obstacles=count).sample(MODEL, np.random.default_rng(seed))

    for seed in range(5):
        alone, first, again = sample(0, seed), sample(3, seed), sample(3, seed)
        np.testing.assert_array_equal(alone.goal.position, first.goal.position)
        assert [item.patrol.speed for item in first.scene.movers] == [
            item.patrol.speed for item in again.scene.movers
        ]
    assert sample(3, 0).scene.movers[0].patrol.speed != sample(3, 1).scene.movers[0].patrol.speed


def test_movers_start_clear_of_the_robot_and_cross_the_workspace():
    for seed in range(30):
        movers = sample_movers(4, MODEL, HOME, np.random.default_rng(seed))
        obstacles = tuple(item.obstacle() for item in movers)
        collision = CollisionModel(MODEL, obstacles)
        scene = [second.startswith("mover") for _, second in collision.pairs]
        assert collision.values(HOME[None])[0][scene].min() > 0.1
        for item in movers:
            assert 0.2 <= np.linalg.norm(item.patrol.velocity(0.0)) <= FASTEST
            path = np.array([item.patrol.position(time) for time in np.linspace(0, 25, 200)])
            assert np.linalg.norm(path[:, :2] - [-0.3, 0.0], axis=1).min() < 1.3


@dataclass(frozen=True)
class Meeting(Reach):
    """Something comes straight at the robot; the goal is out of reach."""

    time_limit: float = 9.0
    moving_obstacles: int = 1

    def sample(self, model, rng):
        shape = Shape("cylinder", [0.2, 0.5])
        item = SceneObject("mover_0", shape, DIRECT_AT_THE_BASE.start, patrol=DIRECT_AT_THE_BASE)
        return Start(Scene((item,)), HOME, Pose(np.array([0.0, 0.0, 9.0]), np.eye(3)))


@pytest.mark.parametrize(("kind", "touched"), [(MaskedMpc, False), (DirectController, True)])
def test_a_robot_that_nobody_steers_steps_aside(kind, touched):
    """The session tells the controller what comes; what stands still is hit, and that is counted."""
    env = HandrailEnv(Meeting())
    outcome = Session(env, kind(env.model), Motionless()).run(0)
    env.close()
    assert (outcome.contact_onsets > 0) == touched
    assert (outcome.smallest_distance < 0.0) == touched


def test_an_episode_among_movers_is_the_seeds():
    first, again = Watcher(), Watcher()
    outcome, _ = (episode(3, each, task="reach", moving_obstacles=1) for each in (first, again))
    assert outcome.success
    assert outcome.contact_onsets == 0
    for one, same in zip(first.frames, again.frames, strict=True):
        np.testing.assert_array_equal(one.state, same.state)


def test_obstacles_become_numbers_and_back():
    env = build_env(SessionConfig(task="reach", moving_obstacles=2), 20)
    env.reset(seed=1)
    held = Obstacle("cup", Shape("cylinder", np.array([0.03, 0.1])), np.array([0, 0, 0.1]), frame="tool")
    there = (*env.obstacles(), held)
    back = from_numbers(to_numbers(there))
    assert len(back) == len(there) > 2
    for one, other in zip(there, back, strict=True):
        words = [(each.shape.kind, each.frame, each.work_surface) for each in (one, other)]
        assert words[0] == words[1]
        for name in ("position", "rotation", "velocity"):
            np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-6)
        np.testing.assert_allclose(one.shape.size, other.shape.size, atol=1e-6)
    with pytest.raises(HandrailError, match=f"expected {MOST} at most"):
        to_numbers((held,) * (MOST + 1))
    with pytest.raises(HandrailError, match="expected rows of"):
        from_numbers(np.full((2, 21), 0.5))
