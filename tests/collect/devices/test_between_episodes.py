"""Laws of what a person at this computer presses while there is no episode."""

import numpy as np
import pytest
from driven_person import Driven

from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.operators.person.person import Phase


@pytest.mark.parametrize("homes", [False, True])
@pytest.mark.parametrize(
    "keys", [["enter"], ["escape"], [","], ["enter", "escape"], ["enter", ","], ["escape", "left"]]
)
def test_keys_pressed_while_an_episode_is_saved_that_its_task_ended(keys, homes):
    """Nobody has seen the next scene: Start does not begin it. Quit and practice hold."""
    driven = Driven("keyboard")
    driven.begin()
    driven.main.presses = keys
    event = EpisodeEvent.QUIT if "escape" in keys else None
    if homes:
        assert driven.local.between() is driven.local.between() is event
    driven.local.reset(driven.view(), np.random.default_rng(0))
    assert driven.person.phase is Phase.READY
    assert driven.person.between is event
    assert driven.person.practises is ("," in keys)


def test_a_quit_after_done_holds_whatever_is_pressed_while_that_is_saved():
    driven = Driven("keyboard")
    driven.begin()
    driven.main.presses = ["right", "escape"]
    assert driven.act() is EpisodeEvent.SUCCESS
    driven.main.presses = ["backspace"]
    driven.local.reset(driven.view(), np.random.default_rng(0))
    assert driven.local.between() is EpisodeEvent.QUIT


def test_a_gripper_pressed_before_the_first_episode_is_forgotten():
    class Early(Driven):
        def view(self):
            self.main.presses = ["y"]
            return super().view()

    driven = Early("keyboard")
    assert driven.person.closed == [0.0]
    assert driven.person.phase is Phase.READY
