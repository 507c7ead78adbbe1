"""A law of the page's gamepad: one that comes back has everything let go."""

from page_script import printed

PAGE = """
let held = false, pads = [];
globalThis.addEventListener = () => {};
Object.defineProperty(globalThis, "navigator", { value: { getGamepads: () => pads } });
globalThis.document = { querySelector: () => null, getElementById: () => null };
const { Gamepad } = await import(process.argv[1]);
const mapping = { buttons: { deadman: 4 }, offered: {}, sticksOf: () => [[0, 1]] };
const inputs = { mapping, isHere: true, owned: new Set(), sticks: () => [[0, "base.vx", 1]] };
const gamepad = new Gamepad(inputs, () => {}, () => {}), found = [];
const look = (plugged, down) => {
  const buttons = Array.from({ length: 17 }, (_, index) => ({ pressed: down && index === 4, value: 0 }));
  pads = plugged ? [{ index: 0, id: "pad", connected: true, buttons, axes: [1, 0, 0, 0] }] : [];
  found.push(gamepad.moves().length);
};
for (const is of ["held", "plugged", "held", "", "held", "plugged", "held"]) look(is !== "", is === "held");
console.log(JSON.stringify(found));
"""


def test_a_gamepad_that_comes_back_moves_nothing_before_its_dead_man_was_let_go():
    """It is plugged in while that is held; let go and held; unplugged, and back while it is held."""
    assert printed(PAGE, "gamepad.js") == [0, 0, 1, 0, 0, 0, 1]
