"""Laws of a page that drives a robot with two hands: which hand is active, and what moves which."""

import numpy as np
import pytest
from page_driver import LOST
from page_levers import GRIP, HOLD, SHIFT, Pad
from page_shots import shoot
from playwright.sync_api import expect

pytestmark = pytest.mark.slow
TRIGGERS = (6, 7)
SIDES = ("left", "right")
XR = """
window.at = (z, emulatedPosition = false) => ({
  emulatedPosition, transform: {position: {x: 0, y: 0, z}, orientation: {x: 0, y: 0, z: 0, w: 1}},
});
window.poses = {left: at(0), right: at(0)};
class Session extends EventTarget {
  visibilityState = "visible";
  updateRenderState() {}
  async requestReferenceSpace() { return {}; }
  steps = [];
  requestAnimationFrame(step) {
    if (this.steps.push(step) > 1) return;
    setTimeout(() => {
      for (const each of this.steps.splice(0)) each(0, window.seen);
      if (window.turned) window.layer?.count();
    }, 20);
  }
  cancelAnimationFrame() { this.steps = []; }
  async end() { this.dispatchEvent(new Event("end")); }
}
window.seen = {
  getPose: (space) => window.poses[space],
  getViewerPose: () => window.turned ? {views: ["left", "right"].map((eye) => ({
    eye, transform: {matrix: window.turned},
    projectionMatrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -0.1, 0],
  }))} : null,
};
delete window.XRWebGLBinding;
WebGL2RenderingContext.prototype.makeXRCompatible = async () => {};
window.XRWebGLLayer = class {
  framebuffer = null; framebufferWidth = 200; framebufferHeight = 100; // the canvas
  constructor(session, gl) { window.layer = Object.assign(this, {gl}); }
  getViewport({eye}) { return {x: eye === "left" ? 0 : 100, y: 0, width: 100, height: 100}; }
  count() { // the colours that each eye sees
    window.colours = [0, 100].map((x) => {
      const seen = new Uint8Array(40000);
      this.gl.readPixels(x, 0, 100, 100, this.gl.RGBA, this.gl.UNSIGNED_BYTE, seen);
      return new Set(new Uint32Array(seen.buffer)).size;
    });
  }
};
const controller = (handedness) => ({handedness, targetRayMode: "tracked-pointer", gripSpace: handedness});
window.controllers = {left: controller("left"), right: controller("right")};
window.press = (kind, side) => session.dispatchEvent(
  Object.assign(new Event(kind), {inputSource: controllers[side]}));
Object.defineProperty(navigator, "xr", {value: {
  isSessionSupported: async (mode) => mode === "immersive-vr",
  requestSession: async () => (window.session = new Session()),
}});
"""


class Two:
    """A cockpit of a robot with two hands, and who looks at its page.

    Args:
        made: the cockpit, on a bench.
        driver: of the page.
    """

    def __init__(self, made, driver):
        self.made, self.driver, self.page = made, driver, driver.page
        self.names = made.cockpit.person.meaning.channels.names

    def moves(self, act, *channels):
        """Do something, again where a busy computer loses the input; return the intent that moves these."""
        wanted = {self.names.index(channel) for channel in channels}
        for _ in range(6):
            act()
            try:
                return self.made.wait(lambda intent: {*np.flatnonzero(intent.raw.values)} == wanted, 6.0)
            except AssertionError:
                self.rest()
        raise AssertionError(f"never moved {channels}; the newest is {self.made.intent}")

    def holds(self, keys, *channels):
        return self.moves(
            lambda: self.driver.hold({f"Key{key}" if key.isalpha() else f"Digit{key}" for key in keys}),
            *channels,
        )

    def rest(self):
        """Let go of everything."""
        self.driver.hold(())
        self.driver.wait(lambda: self.driver.phase != LOST, 10.0)

    def grips(self, *grippers):
        self.made.wait(lambda intent: intent.grippers == grippers)

    def expect_active(self, hand):
        expect(self.page.locator("#hands [aria-pressed=true]")).to_have_text(hand)
        expect(self.page.locator(".hand-tag[aria-pressed=true]")).to_have_text(hand)


class TwoSticks(Two):
    """The same with a gamepad."""

    def hold(self, axes, shifted=False):
        pad = Pad(self.driver)
        pad.press(SHIFT, shifted)
        pad.press(HOLD, True)
        self.page.evaluate("(axes) => { window.pad.axes = axes; }", axes)

    def sticks(self, axes, shifted, *channels):
        return self.moves(lambda: self.hold(axes, shifted), *channels)

    def rest(self):
        self.hold([0, 0, 0, 0])
        super().rest()


class TwoControllers(Two):
    """The same with a headset's controllers."""

    def enter(self):
        self.page.locator("#xr").click()
        expect(self.driver.at("frame")).to_have_value("world")

    def press(self, kind, *sides):
        for side in sides:
            self.page.evaluate("([kind, side]) => press(kind, side)", [kind, side])

    def lead(self, **places):
        """Hold both grips anew, and then go to places."""
        self.rest()
        self.press("squeezestart", *SIDES)
        self.page.wait_for_timeout(300)
        for side, place in places.items():
            self.page.evaluate(f"poses.{side} = at({place})")

    def rest(self):
        self.press("squeezeend", *SIDES)
        self.page.evaluate("poses.left = at(0); poses.right = at(0)")
        super().rest()


@pytest.fixture
def two(on_bench):
    """Open a page of a robot with two hands."""

    def opened(mode="ee", kind=Two, script=""):
        made, driver = on_bench(mode, "tiago_pro", script=script)
        driver.begin()
        return kind(made, driver)

    return opened


def test_the_active_hand_is_chosen_by_key_button_tag_and_a_click_on_it(two):
    made = two()
    page, driver = made.page, made.driver
    made.expect_active("left")
    made.holds("W", "left.vx")
    driver.press("Slash")  # while the key is held
    made.expect_active("right")
    made.holds("W", "right.vx")
    page.locator("#hands button", has_text="left").click()
    made.expect_active("left")
    made.holds("W", "left.vx")
    made.rest()
    page.locator(".hand-tag", has_text="right").click()
    made.expect_active("right")
    tag = page.locator(".hand-tag", has_text="left").bounding_box()
    page.mouse.click(tag["x"] - 12, tag["y"] - 10)  # the hand itself, beside its tag
    made.expect_active("left")
    made.holds("W", "left.vx")
    shoot(page, "hands")


def test_each_gripper_has_its_key_and_both_hands_have_theirs(two):
    made = two("both")
    for key, grippers in (("ShiftLeft", (1, 0)), ("ShiftRight", (1, 1)), ("ShiftLeft", (0, 1))):
        made.driver.press(key)
        made.grips(*grippers)
    made.holds("WI", "left.vx", "right.vx")
    made.holds("AO", "left.vy", "right.vz")
    made.holds("Q", "left.wz")
    made.driver.press("Slash")
    made.holds("Q", "right.wz")  # turns are the active hand's
    made.moves(made.rest)
    made.driver.press("KeyH")
    expect(made.driver.at("help-table")).to_contain_text("right hand up")
    expect(made.driver.at("help-actions")).to_contain_text("open or close the right gripper")


def test_a_pair_is_steered_as_one_hand_and_parted(two):
    made = two("pair")
    apart = made.names.index("apart.v")
    assert not made.holds("W", "pair.vx").mask[apart]  # the robot keeps it
    assert made.holds("0", "apart.v").values[apart] > 0.0
    made.moves(made.rest)
    assert made.holds("9", "apart.v").values[apart] < 0.0


def test_a_torso_beside_a_hand_has_keys_and_a_stick(two):
    made = two("hand+torso", TwoSticks, Pad.SCRIPT)
    for key, sign in (("Period", 1.0), ("Comma", -1.0)):
        torso = made.moves(lambda key=key: made.driver.hold({key}), "joint.torso_lift_joint")
        assert np.sign(torso.values.sum()) == sign
        made.moves(made.rest)
    made.sticks([0, 0, 0, -1], True, "joint.torso_lift_joint")


def test_two_sticks_of_a_gamepad_are_two_hands_and_its_triggers_close_grippers(two):
    made = two("both", TwoSticks, Pad.SCRIPT)
    pad = Pad(made.driver)
    made.sticks([-0.9, -0.8, -0.7, -0.6], False, "left.vx", "left.vy", "right.vx", "right.vy")
    made.sticks([-0.9, -0.8, -0.7, -0.6], True, "left.vz", "left.wz", "right.vz", "right.wz")
    made.moves(lambda: pad.press(HOLD, False))  # the dead-man is of both
    for button, grippers in zip(TRIGGERS, ((1, 0), (1, 1)), strict=True):
        pad.tap(button)
        made.grips(*grippers)
    pad.tap(GRIP)
    made.expect_active("right")
    made.rest()
    made.driver.choose("mode", "pair")
    made.sticks([0, -1, 0, 0], False, "pair.vx")
    made.sticks([0, 0, 0, -1], True, "apart.v")


def test_each_controller_of_a_headset_leads_its_hand_while_its_grip_is_held(two):
    made = two("both", TwoControllers, XR)
    made.enter()
    made.moves(made.lead)  # neither has moved since its press
    led = made.moves(lambda: made.lead(left=-0.05, right=0.05), "left.vx", "right.vx")
    assert led.raw.device == "xr"
    assert led.values[made.names.index("left.vx")] > 0.0 > led.values[made.names.index("right.vx")]
    made.press("squeezeend", "left")
    made.moves(lambda: None, "right.vx")
    for side, grippers in zip(SIDES, ((1, 0), (1, 1)), strict=True):
        made.press("selectstart", side)
        made.press("selectend", side)
        made.grips(*grippers)
    made.moves(lambda: None, "right.vx")  # a trigger lets go of nothing


@pytest.mark.parametrize("trouble", ["at(-0.05, true)", "at(NaN)", "null"])
def test_a_controller_that_is_lost_lets_go_of_both_hands(two, trouble):
    made = two("both", TwoControllers, XR)
    made.enter()
    made.moves(lambda: made.lead(left=-0.05, right=-0.05), "left.vx", "right.vx")
    made.page.evaluate(f"poses.right = {trouble}")
    made.moves(lambda: None)
    made.page.evaluate("poses.right = at(-0.05)")
    made.page.wait_for_timeout(300)
    made.moves(lambda: None)  # until they are pressed anew
    expect(made.driver.at("notice")).to_contain_text("lost its place")


def test_a_grip_takes_its_hand_where_one_is_steered(two):
    made = two("ee", TwoControllers, XR)
    made.enter()
    made.expect_active("left")
    made.press("squeezestart", "right")
    made.expect_active("right")
    made.page.evaluate("poses.right = at(-0.05)")
    made.moves(lambda: None, "right.vx")


def test_a_headset_shows_the_robot_ahead_and_not_behind_and_then_the_page_is_back(two):
    made = two("both", TwoControllers, XR)
    made.page.evaluate("window.turned = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]")  # by columns
    made.enter()
    sees = "(ahead) => window.colours?.every((count) => (count > 130) === ahead)"
    made.page.wait_for_function(sees, arg=True)
    made.page.evaluate("turned[0] = turned[10] = -1")  # about the vertical
    made.page.wait_for_function(sees, arg=False)
    made.page.evaluate("session.end()")
    made.page.wait_for_function("() => document.getElementById('view').width > 200")


def test_digits_turn_every_joint_one_group_after_the_other(two):
    """The arms' joints and then the rest, in turn or by a click on a bar; each bar says its keys."""
    made = two("joints")
    bars, rest = made.page.locator("#sliders .slider"), ["torso_lift", "head_1", "head_2"]
    groups = [*([f"arm_{side}_{n}" for n in range(1, 8)] for side in SIDES), rest]
    assert {f"joint.{each}_joint" for group in groups for each in group} == {*made.names[-17:]}
    for active, group in zip((*SIDES, "right"), groups, strict=True):
        made.expect_active(active)
        expect(bars.filter(has=made.page.locator("kbd:not(:empty)"))).to_have_count(len(group))
        for digit, joint in enumerate(group, 1):
            made.holds(str(digit), f"joint.{joint}_joint")
        made.moves(made.rest)
        made.driver.press("Slash")
    bars.filter(has_text="head 2").locator("span").click()
    made.holds("C", "joint.head_2_joint")
    shoot(made.page, "digits")
