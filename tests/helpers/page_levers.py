"""What a person has under their fingers: levers that are pushed one way or the other, for a while."""

import time

import numpy as np
from playwright.sync_api import expect

_PAD = """
window.pad = {axes: [0, 0, 0, 0], connected: true, id: "pad", index: 0, mapping: "standard", timestamp: 0,
              buttons: Array.from({length: 17}, () => ({pressed: false, touched: false, value: 0}))};
navigator.getGamepads = () => [window.pad];
"""
SHIFT, GRIP, HOLD = 5, 0, 4  # buttons of a gamepad: sticks turn the hand; gripper; dead-man


class Keys:
    """Pairs of keys, as the page's card of keys says.

    Args:
        driver: who looks at the page.
    """

    SCRIPT = ""

    def __init__(self, driver):
        self._driver = driver
        driver.press("KeyH")
        expect(driver.at("help-table").locator("button").first).to_be_visible()
        names = [_code(name) for name in driver.at("help-table").locator("button").all_inner_texts()]
        driver.press("KeyH")
        self.pairs = list(zip(names[::2], names[1::2], strict=True))
        self.groups = [list(range(len(self.pairs)))]

    def __len__(self):
        return len(self.pairs)

    def hold(self, signs):
        """Push the levers that have a sign, (k,), and let go of the others."""
        keys = {
            pair[0] if sign > 0 else pair[1] for pair, sign in zip(self.pairs, signs, strict=True) if sign
        }
        self._driver.hold(keys)

    def grip(self):
        self._driver.press("ShiftLeft")


class Pad:
    """Two sticks of a gamepad that is not there; while a button is held they turn the hand.

    Args:
        driver: who looks at a page that has got `Pad.SCRIPT`.
    """

    SCRIPT = _PAD

    def __init__(self, driver):
        self._driver = driver
        self.groups = [[0, 1, 2, 3], [4, 5]]

    def __len__(self):
        return 6

    def hold(self, signs):
        """Push the levers that have a sign, (6,): of the sticks, and of the left one with the button held."""
        shifted = any(signs[4:])
        sticks = [*signs[4:], 0, 0] if shifted else signs[:4]
        self._set([float(sign) for sign in sticks], shifted)

    def grip(self):
        self.tap(GRIP)

    def tap(self, button):
        self.press(button, True)
        time.sleep(0.2)
        self.press(button, False)

    def press(self, index, pressed):
        change = "([index, state]) => Object.assign(window.pad.buttons[index], state)"
        self._driver.page.evaluate(change, [index, {"pressed": pressed, "value": float(pressed)}])

    def _set(self, axes, shifted):
        self._driver.page.evaluate("(axes) => { window.pad.axes = axes; }", axes)
        self.press(SHIFT, bool(shifted))
        self.press(HOLD, any(axes))


def push(levers, seconds):
    """Push every lever for its own time, (k,) [s], those that can at once; return how long it was."""
    pushed = np.zeros(len(levers))
    for group in levers.groups:
        mine = np.zeros(len(levers))
        mine[group] = np.asarray(seconds)[group]
        if not mine.any():
            continue
        begun, signs = time.monotonic(), np.sign(mine)
        levers.hold(signs)
        while signs.any():
            time.sleep(max(0.0, np.abs(mine[signs != 0]).min() - (time.monotonic() - begun)))
            over = (np.abs(mine) <= time.monotonic() - begun) & (signs != 0)
            signs = np.where(over, 0.0, signs)
            levers.hold(signs)
            pushed[over] = (time.monotonic() - begun) * np.sign(mine[over])
    return pushed


def _code(name):
    return f"Digit{name}" if name.isdigit() else f"Key{name}" if len(name) == 1 else name
