"""Laws of what the page shows of two hands: where each is led, and each one's plan and bodies."""

import json
from dataclasses import replace

import numpy as np
import pytest

from handrail.collect.cockpit import stage
from handrail.collect.cockpit.ahead import AHEAD, hands_ahead
from handrail.collect.cockpit.snapshot import Snapshots
from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import View
from handrail.collect.operators.person.inputs import Ask
from handrail.collect.operators.person.person import Person
from handrail.collect.session.build import build_env
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Diagnostics
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.trajectory import Trajectory
from handrail.datasets.recording.frames import Frame


@pytest.fixture(scope="module")
def env():
    made = build_env(SessionConfig(task="reach", robot="tiago_pro", hand="right"), 20)
    made.reset(seed=3)
    yield made
    made.close()


def asked(env, **values):
    channels = Channels.of(env.model.description)
    numbers = np.zeros(channels.size)
    for name, value in values.items():
        numbers[channels.names.index(name.replace("_", "."))] = value
    return replace(Intent.idle(channels), values=numbers, mask=numbers != 0.0, grippers=(0.0, 0.0))


def ahead(env, **values):
    return hands_ahead(env.model, asked(env, **values), env.plant.tools, env.plant.state().q)


def test_each_hand_is_led_by_its_own_channels(env):
    left, right = env.plant.tools
    one, other = ahead(env, left_vx=0.1, right_vz=-0.2)
    np.testing.assert_allclose(one.position - left.position, [0.1 * AHEAD, 0, 0], atol=1e-12)
    np.testing.assert_allclose(other.position - right.position, [0, 0, -0.2 * AHEAD], atol=1e-12)
    alone, none = ahead(env, left_vx=0.1)
    assert alone is not None
    assert none is None


def test_a_pair_is_led_as_one_body_and_parts_along_the_line_between(env):
    between = lambda one, other: other.rotation.T @ (one.position - other.position)  # noqa: E731
    left, right = env.plant.tools
    one, other = ahead(env, pair_vx=0.1, pair_wx=0.5, pair_wz=-0.4)
    np.testing.assert_allclose(between(one, other), between(left, right), atol=1e-9)
    np.testing.assert_allclose(other.rotation.T @ one.rotation, right.rotation.T @ left.rotation, atol=1e-9)
    middle = 0.5 * (one.position + other.position - left.position - right.position)
    np.testing.assert_allclose(middle, [0.1 * AHEAD, 0, 0], atol=1e-9)
    one, other = ahead(env, apart_v=0.2)
    apart, before = (np.linalg.norm(between(*each)) for each in ((one, other), (left, right)))
    assert apart - before == pytest.approx(0.2 * AHEAD)


def test_a_moment_has_both_hands_and_says_which_is_active(env):
    person = Person(env.model, {"ee": MODES["ee"]}, "ee")
    nothing = np.zeros(1)
    plan = Trajectory(np.full((21, env.model.size), 0.1), 0.1)
    said = {"state": nothing, "environment": nothing, "images": {}, "action": nothing, "command": nothing}
    said |= {"contacts": 0, "success": False, "done": False, "wall_clock": 0.0, "number": 0, "safe": 0}
    snapshots, view = Snapshots(env), View(env.plant.state(), env.task_state())
    snapshots.see(
        Frame(intent=asked(env, left_vx=0.1, right_vx=0.1), diagnostics=Diagnostics(), plan=plan, **said)
    )
    for hand, number in (("right", 1), ("left", 0)):  # it begins with that of the task
        assert person.setting.hand == hand
        moment = json.loads(json.dumps(snapshots.now(view, person, 1.0), allow_nan=False))
        assert moment["hand"] == number
        assert moment["aim"]["hand"] == 1
        assert [len(each) for each in moment["tools"]] == [len(each) for each in moment["ghosts"]] == [7, 7]
        assert len({len(path) for path in moment["paths"]}) == 1
        assert moment["paths"][0] != moment["paths"][1]
        person.ask(Ask("hand", "left"))


def test_each_hand_has_bodies_of_its_own(env):
    compiled = env.simulation.mujoco_model
    left, right = (set(stage.hand(compiled, hand)) for hand in env.model.description.hands)
    assert left
    assert right
    assert not left & right
