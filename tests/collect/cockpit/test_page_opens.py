"""Law: on the real page, in Chromium, a key reaches the robot while it is held, and no longer."""

import numpy as np


def test_a_key_moves_the_hand_while_it_is_held(on_bench):
    made, driver = on_bench()
    driver.begin()
    driver.page.keyboard.down("KeyW")
    held = made.wait(lambda intent: intent.raw.axes == 1)
    assert np.flatnonzero(held.raw.values).tolist() == [3]
    assert (held.mode, held.raw.device) == ("ee", "keyboard")
    driver.page.keyboard.up("KeyW")
    made.wait(lambda intent: intent.raw.axes == 0)
