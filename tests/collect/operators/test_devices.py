"""The laws of input devices: one axis at a time, a leader without jumps, switches that cost time."""

from dataclasses import replace

import numpy as np
import pytest
from device_helpers import GOAL, HOME, MODEL, PERFECT, PERIOD, Wisher, drive, first_view

from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.input_map import StickMap
from handrail.collect.operators.scripted.reach import ReachScript
from handrail.collect.operators.scripted.scripted import DEVICES, gains_of
from handrail.collect.operators.scripted.single_axis import clear_order, sweep_clearance
from handrail.collect.operators.scripted.steering import Gains, MotionGoal
from handrail.controllers.baselines.unprotected import split_controller
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.shape import Obstacle, Shape

NAMES = ["direct_single", "direct_erring", "leader", "decoupled", "direct"]


@pytest.fixture(scope="module")
def view() -> View:
    return first_view()


@pytest.mark.parametrize("name", NAMES)
def test_every_device_brings_the_hand_to_the_goal(view, name):
    _, path = drive(view, name, PERFECT, seconds=30.0)
    nearest = min(np.linalg.norm(MODEL.pose(q).position - GOAL.position) for q in path[::10])
    assert nearest < 0.03


def test_one_axis_at_a_time(view):
    intents, _ = drive(view, "direct_single", HumanSettings())
    channels = Channels.of(MODEL.description)
    assert all(np.count_nonzero(intent.mask) == 1 for intent in intents)
    assert all(np.count_nonzero(intent.values) <= 1 for intent in intents)
    assert all(intent.raw.axes <= 1 for intent in intents)
    used = {channels.names[int(np.argmax(intent.mask))] for intent in intents}
    assert {name.split(".")[0] for name in used} == {"base", "joint"}
    assert not used & {f"joint.{name}" for name in MODEL.description.base.joints}


def test_an_erring_operator_looks_for_the_axis_and_guesses_its_sign(view):
    """Every change of the axis takes 0.15 log₂ 10 s; half of the first pushes go the wrong way."""
    first, pauses = [], []
    for seed in range(12):
        intents, path = drive(view, "direct_erring", PERFECT, seconds=20.0, seed=seed)
        axes = [int(np.argmax(intent.mask)) for intent in intents]
        signs = dict[int, float]()
        for step in range(1, len(axes)):
            if axes[step] != axes[step - 1]:
                moving = next((k for k in range(step, len(axes)) if intents[k].values.any()), len(axes))
                pauses.append((moving - step) * PERIOD)
            if axes[step] >= 9 and intents[step].values.any():
                signs.setdefault(axes[step], float(np.sign(intents[step].values[axes[step]])))
        first += [sign == np.sign((path[-1] - HOME)[axis - 9]) for axis, sign in signs.items()]
    assert min(pauses) >= 0.15 * np.log2(10.0) - PERIOD
    assert 0.3 < np.mean(first) < 0.7
    one, same = (drive(view, "direct_erring", HumanSettings(), seed=3)[1] for _ in range(2))
    np.testing.assert_array_equal(one, same)


@pytest.mark.parametrize("name", ["direct_single", "decoupled", "leader", "ee"])
def test_switches_are_counted_and_cost_time(view, name):
    human = replace(PERFECT, switch_time=0.6)
    intents, _ = drive(view, name, human, seconds=6.0)
    masks = [intent.mask.tobytes() for intent in intents]
    changes = [step for step in range(1, len(masks)) if masks[step] != masks[step - 1]]
    assert intents[-1].raw.switches == len(changes)
    assert bool(changes) == (name in ("direct_single", "decoupled"))
    for step in changes:
        pause = intents[step : step + 12]
        assert all(not intent.values.any() for intent in pause), step


def test_a_leader_starts_without_a_jump_and_never_outruns_its_operator(view):
    """The target begins where the arm is, and moves no faster than a joint's full stick."""
    intents, path = drive(view, "leader", HumanSettings(), seconds=8.0)
    arm = intents[0].mask.copy()
    arm[:3] = False
    raw = np.array([intent.raw.values[arm] for intent in intents])
    np.testing.assert_allclose(raw[0], HOME[3:], atol=1e-9)
    np.testing.assert_allclose(intents[0].values, 0.0, atol=1e-9)
    rate = DEVICES["leader_arm"].gains.joint_rate
    assert np.max(np.abs(np.diff(raw, axis=0))) <= rate * PERIOD + 1e-9
    assert np.max(np.abs(path[:-1, 3:] - raw)) < 0.35
    assert len({intent.mask.tobytes() for intent in intents}) == 1


def test_a_leader_moves_base_and_arm_at_once(view):
    """Whatever the script attends to."""
    intents, path = drive(view, "leader", PERFECT, seconds=2.0)
    moving = np.abs(np.array([intent.values[intent.mask] for intent in intents[1:]])) > 1e-3
    both = moving[:, :3].any(axis=1) & moving[:, 3:].any(axis=1)
    assert both.mean() > 0.9
    assert np.abs(path[-1] - HOME)[:2].max() > 0.05


def test_a_still_leader_holds_the_arm(view):
    class Rest(Wisher):
        def motion_goal(self, view):
            return MotionGoal.rest()

    _, path = drive(view, "leader", HumanSettings(), seconds=5.0, script=Rest())
    assert np.max(np.abs(path - HOME)) < 0.03


def test_the_split_controller_coordinates_nothing():
    """The base's stick moves no arm joint, the hand's moves no base joint."""
    sticks = StickMap(MODEL, MODES["decoupled"], Gains())
    controller = split_controller(MODEL)
    state = State(HOME, np.zeros(MODEL.size))
    operator_wish = MotionGoal(np.array([0.1, 0.0, 0.1, 0.0, 0.1, 0.0]), np.array([0.2, 0.1, 0.1]))
    for focus, resting in (("hand", slice(0, 3)), ("base", slice(3, None))):
        controller.reset()
        mask, values = sticks.wanted(replace(operator_wish, focus=focus), state)
        velocity = controller.update(state, Intent(values, mask)).velocity(PERIOD)
        np.testing.assert_array_equal(velocity[resting], 0.0)
        assert np.any(velocity)


@pytest.mark.parametrize("name", NAMES)
def test_the_same_seed_is_the_same_operator(view, name):
    first, again = (drive(view, name, HumanSettings(), seconds=2.0)[0] for _ in range(2))
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a.values, b.values)
        np.testing.assert_array_equal(a.raw.values, b.raw.values)


@pytest.mark.parametrize("name", NAMES)
def test_nothing_that_is_drawn_decides_where_they_go(view, name):
    """Who errs in nothing and has no moods does the same in every episode of a scene."""
    human = HumanSettings(noise=0.0, drift=0.0, misjudgement=0.0, moods=0.0)
    script = ReachScript(MODEL, gains_of(MODEL, MODES[name], human), drives=False)
    one, same = (drive(view, name, human, 6.0, script, seed=seed)[1] for seed in (0, 1))
    np.testing.assert_array_equal(one, same)
    other = drive(view, name, replace(human, moods=0.3), 6.0, script, seed=1)[1]
    assert not np.array_equal(one, other)


def test_joints_are_moved_in_an_order_that_hits_nothing():
    """A table under the hand: what lowers the arm has to wait for what lifts it."""
    table = Obstacle("table", Shape("box", np.array([0.6, 2.0, 0.5])), np.array([0.1, 0.0, 0.25]))
    collision, goal, clear = CollisionModel(MODEL, (table,)), HOME.copy(), 0.02
    goal[[4, 5]] += [0.5, -0.8]  # shoulder down, elbow up
    assert sweep_clearance(collision, HOME, 4, 0.5) < clear
    for preferred in ([4, 5], [5, 4]):
        assert clear_order(collision, HOME, goal, preferred, clear) == [5, 4]
    assert clear_order(CollisionModel(MODEL), HOME, goal, [4, 5], clear) == [4, 5]
    everywhere = Obstacle("wall", table.shape, MODEL.pose(HOME).position)
    assert clear_order(CollisionModel(MODEL, (everywhere,)), HOME, goal, [4, 5], clear) == []
