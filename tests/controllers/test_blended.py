"""Blended control: the operator and an actor that wants the hand at its goal share one objective."""

import numpy as np
import pytest
from ideal_robot import CHANNELS, HOME, MODEL, asking, roll

from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.sources import Intents, IntentSource
from handrail.controllers.mpc.blended import SHARE, BlendedMpc
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.model import Pose

START = MODEL.pose(HOME)
AHEAD = Pose(START.position + [0.2, 0.0, 0.0], START.rotation)
ASIDE = dict(zip(CHANNELS.names[CHANNELS.hand_slice()], (0.0, 0.1, 0.0, 0.0, 0.0, 0.0), strict=True))
NOTHING = dict.fromkeys(ASIDE, 0.0)


def driven(values, steps, goal=AHEAD, controller=None):
    """Return positions, velocities and commands of a hand that has a goal."""
    blend = controller or BlendedMpc(MODEL)
    blend.reset()
    if goal is not None:
        blend.aim(goal)
    return roll(blend, [asking(values, "ee")] * steps)


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.0, 1.4, 2.0, 3.1])
def test_the_hand_goes_the_weighted_mean_of_both_ways(angle):
    """The farther apart both ways are, the less the actor counts; from a right angle on nothing."""
    asked = 0.1 * np.array([np.cos(angle), np.sin(angle)])
    q, v, commands = driven(NOTHING | dict(zip(list(ASIDE)[:2], asked, strict=True)), 12)
    assert {each.diagnostics.status for each in commands} == {Status.OK}
    actor = 1.2 * (AHEAD.position - MODEL.pose(q[-1]).position)[:2]  # k (p* − p), below its bound
    share = SHARE * max(0.0, asked @ actor / np.linalg.norm(asked) / np.linalg.norm(actor))
    expected = (1.0 - share) * asked + share * actor
    np.testing.assert_allclose((MODEL.jacobian(q[-1]) @ v[-1])[:2], expected, atol=0.015)


def test_an_operator_who_pushes_roughly_is_led_to_the_goal():
    """From pushes 45 degrees off the way, with and without an actor: how near the hand comes."""
    rough = NOTHING | dict(zip(list(ASIDE)[:2], (0.07, 0.07), strict=True))
    left = {}
    for controller in (BlendedMpc(MODEL), MaskedMpc(MODEL)):
        q, *_ = driven(rough, 60, AHEAD if isinstance(controller, BlendedMpc) else None, controller)
        places = np.array([MODEL.pose(each).position for each in q])
        left[type(controller)] = np.linalg.norm(places - AHEAD.position, axis=1).min()
    assert left[BlendedMpc] < 0.8 * left[MaskedMpc]


def test_let_go_the_robot_stands_whatever_the_actor_wants():
    q, v, _ = driven(NOTHING, 30)
    np.testing.assert_allclose(q[-1], HOME, atol=1e-3)
    np.testing.assert_allclose(v[-1], 0.0, atol=1e-3)


@pytest.mark.parametrize("forgotten", [False, True])
def test_without_a_goal_it_is_the_masked_mpc_to_the_bit(forgotten):
    blend = BlendedMpc(MODEL)
    if forgotten:
        blend.aim(AHEAD)  # `driven` resets it
    found, plain = driven(ASIDE, 10, None, blend), driven(ASIDE, 10, None, MaskedMpc(MODEL))
    np.testing.assert_array_equal(found[0], plain[0])


def test_a_nan_of_the_operator_brakes_the_actor_too():
    _, v, commands = driven(ASIDE, 10)
    blend = BlendedMpc(MODEL)
    blend.aim(AHEAD)
    asks = [asking(ASIDE, "ee")] * 10 + [asking(ASIDE | {next(iter(ASIDE)): np.nan}, "ee")] * 30
    _, stopped, commands = roll(blend, asks)
    assert np.abs(v[-1]).max() > 0.02
    assert commands[-1].diagnostics.status is Status.INVALID_INTENT
    np.testing.assert_allclose(stopped[-1], 0.0, atol=1e-9)


def test_one_of_several_operators_from_the_future_brakes_it_too():
    blend, mask = BlendedMpc(MODEL), CHANNELS.mask("ee")
    blend.reset()
    blend.aim(AHEAD)
    near, far = (Intent(np.where(mask, 0.1, 0.0), mask, time=time) for time in (0.0, 10.0))
    both = Intents.of([IntentSource("a", near, 0.5), IntentSource("b", far, 0.5)], (0.0,), near)
    command = blend.update(State(HOME, np.zeros(len(HOME)), time=0.0), both)
    assert command.diagnostics.status == Status.INVALID_INTENT
