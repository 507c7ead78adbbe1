"""A gamepad, through SDL (pygame): the same places of sticks and buttons on every pad that SDL knows."""

import os
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from handrail.collect.devices.device import DeviceInput, StickShape
from handrail.controllers.errors import HandrailError, imported

AXES = ("left_x", "left_y", "right_x", "right_y", "left_trigger", "right_trigger")  # in SDL's order
BUTTONS = (
    *("a", "b", "x", "y", "back", "guide", "start", "left_stick", "right_stick"),
    *("left_shoulder", "right_shoulder", "up", "down", "left", "right"),
)
CONTROLS = (*AXES, *BUTTONS)
_FULL = 32767.0
_PERIOD = 0.008  # between two looks [s]
_DOWN = (0.02, 0.005)  # deflection beyond which a trigger goes down, and stays so: 21 and 16 % of its way
_HEADLESS = {  # no window, no sound, and events also while another window has the focus
    "SDL_VIDEODRIVER": "dummy",
    "SDL_AUDIODRIVER": "dummy",
    "SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS": "1",
    "PYGAME_HIDE_SUPPORT_PROMPT": "1",
}


class Gamepad:
    """The first gamepad that SDL knows; a device.

    Args:
        shape: of its sticks.
        clock: of readings [s].
    """

    name = "gamepad"

    def __init__(self, shape: StickShape | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self._shape, self._clock = shape or StickShape(), clock
        self._pad: Any = None
        self._down: frozenset[str] = frozenset()

    def open(self) -> None:
        """Find a gamepad."""
        pygame, controllers = _sdl()
        pygame.display.init()
        controllers.init()
        pygame.event.pump()
        known = [index for index in range(controllers.get_count()) if controllers.is_controller(index)]
        if not known:
            raise HandrailError(_why_none(controllers.get_count()))
        self._pygame, self._pad, self._down = pygame, controllers.Controller(known[0]), frozenset()

    def read(self) -> DeviceInput:
        """Return its sticks and buttons."""
        time.sleep(_PERIOD)
        self._pygame.event.pump()
        self._pygame.event.clear()
        if not self._pad.attached():
            raise HandrailError("gamepad: unplugged; plug it in again, then press start")
        sticks = {name: self._shape(self._pad.get_axis(index) / _FULL) for index, name in enumerate(AXES)}
        buttons = {name: 1.0 for index, name in enumerate(BUTTONS) if self._pad.get_button(index)}
        held = {name: value for name, value in sticks.items() if value} | buttons
        before = self._down
        self._down = frozenset(name for name, value in held.items() if abs(value) > _DOWN[name in before])
        presses = tuple(name for name in CONTROLS if name in self._down - before)
        return DeviceInput(self._clock(), held, presses)

    def close(self) -> None:
        """Give it back."""
        if self._pad:
            self._pad.quit()
        self._pad = None


def _sdl() -> tuple[Any, Any]:
    """Return pygame and its gamepads, without a window."""
    for name, value in _HEADLESS.items():
        os.environ.setdefault(name, value)
    wanted = "--operator gamepad", "pygame", "devices"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # pygame's own use of setuptools
        return imported("pygame", *wanted), imported("pygame._sdl2.controller", *wanted)


def _why_none(others: int) -> str:
    """Return what to do where SDL has no gamepad.

    Args:
        others: joysticks that it sees, but does not know as gamepads.
    """
    if others:
        return (
            "gamepad: found a joystick whose layout SDL does not know; say it in the variable "
            "SDL_GAMECONTROLLERCONFIG, or use another pad"
        )
    closed = [path for path in Path("/dev/input").glob("js*") if not os.access(path, os.R_OK)]
    if closed:
        return (
            f"gamepad: {closed[0]} may not be read; add yourself to its group "
            "(sudo usermod -aG input $USER), log in again"
        )
    return "gamepad: expected one, found none; plug it in, or switch it on and pair it, then try again"
