"""Laws of what a person at this computer presses while there is no episode."""

import numpy as np
import pytest
from driven_person import Driven

from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.operators.person.person import Phase


@pytest.mark.parametrize("key", ["enter", "escape", ","])
def test_keys_pressed_while_an_episode_is_saved_that_its_task_ended(key):
    """Nobody has seen the next scene: Start does not begin it. Quit and practice hold."""
    driven = Driven("keyboard")
    driven.begin()
    driven.main.presses = [key]
    driven.local.reset(driven.view(), np.random.default_rng(0))
    assert driven.person.phase is Phase.READY
    assert driven.local.between() is (EpisodeEvent.QUIT if key == "escape" else None)
    assert driven.person.practises is (key == ",")


def test_a_gripper_pressed_before_the_first_episode_is_forgotten():
    class Early(Driven):
        def view(self):
            self.main.presses = ["y"]
            return super().view()

    driven = Early("keyboard")
    assert driven.person.closed == [0.0]
    assert driven.person.phase is Phase.READY
