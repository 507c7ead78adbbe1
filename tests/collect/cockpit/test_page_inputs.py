"""Laws of what a person can move on the page: what is held moves, and nothing else."""

import math

import numpy as np
import pytest
from page_levers import HOLD, Pad
from page_shots import shoot
from playwright.sync_api import expect

pytestmark = pytest.mark.slow
PHONE = {"viewport": {"width": 844, "height": 390}, "has_touch": True, "is_mobile": True}
XR = """
window.pose = {emulatedPosition: false,
  transform: {position: {x: 0, y: 0, z: 0}, orientation: {x: 0, y: 0, z: 0, w: 1}}};
class Session extends EventTarget {
  visibilityState = "visible";
  updateRenderState() {}
  async requestReferenceSpace() { return (window.space = new EventTarget()); }
  cancelAnimationFrame() {}
  requestAnimationFrame(step) { setTimeout(() => step(0, {getViewerPose: () => window.pose}), 20); }
  domOverlayState = {type: "screen"};
  async end() { this.dispatchEvent(new Event("end")); }
}
window.XRWebGLLayer = class {};
window.finger = {};
window.press = (kind) => session.dispatchEvent(Object.assign(new Event(kind), {inputSource: finger}));
Object.defineProperty(navigator, "xr", {value: {
  isSessionSupported: async (mode) => mode === "immersive-ar",
  requestSession: async () => (window.session = new Session()),
}});
"""


def at_rest(intent):
    return intent.raw.axes == 0


def moves(*axes):
    """Say whether an intent moves these channels, and no others."""
    return lambda intent: set(np.flatnonzero(intent.raw.values)) == set(axes)


def pad(page, index, pressed):
    page.evaluate(
        "([i, p]) => Object.assign(window.pad.buttons[i], {pressed: p, value: Number(p)})", [index, pressed]
    )


def test_a_gamepad_moves_only_while_its_dead_man_is_held(on_bench):
    made, driver = on_bench(script=Pad.SCRIPT)
    page = driver.page
    expect(driver.at("pad")).to_contain_text("hold L1 to move")
    driver.begin()
    page.evaluate("window.pad.axes = [0, -1, 0, 0]")
    page.wait_for_timeout(500)
    assert at_rest(made.wait(lambda intent: True))
    pad(page, HOLD, True)
    held = made.wait(lambda intent: intent.raw.axes == 1)
    assert held.raw.device == "gamepad"
    pad(page, HOLD, False)
    made.wait(at_rest)
    pad(page, HOLD, True)
    made.wait(lambda intent: intent.raw.axes == 1)
    page.evaluate("window.pad.connected = false")  # unplugged
    made.wait(at_rest)
    expect(driver.at("notice")).to_contain_text("unplugged")


def test_a_gamepad_is_changed_on_the_card_and_that_is_remembered(on_bench):
    _, driver = on_bench(script=Pad.SCRIPT)
    page = driver.page
    driver.press("KeyH")
    page.get_by_role("button", name="hold to move: L1").click()
    pad(page, 6, True)
    expect(page.get_by_role("button", name="hold to move: L2")).to_be_visible()
    pad(page, 6, False)
    expect(page.get_by_role("button", name="hand down: L1")).to_be_visible()  # they changed places
    shoot(page, "help-gamepad")
    page.reload()
    expect(driver.at("pad")).to_contain_text("hold L2 to move")
    driver.press("KeyH")
    driver.at("help-reset").click()
    expect(driver.at("pad")).to_contain_text("hold L1 to move")


def test_a_gamepad_stops_while_the_card_waits_for_a_button(on_bench):
    _, driver = on_bench(script=Pad.SCRIPT)
    page = driver.page
    driver.press("KeyH")
    page.get_by_role("button", name="hold to move: L1").click()
    pad(page, 1, True)
    driver.expect_phase("STOPPED")
    pad(page, 1, False)
    expect(page.get_by_role("button", name="hold to move: L1")).to_be_visible()  # and B is still the stop
    expect(page.get_by_role("button", name="stop: B")).to_be_visible()


def test_keys_are_changed_on_the_card_but_never_the_stop(on_bench):
    _, driver = on_bench()
    page = driver.page
    driver.press("KeyH")
    page.get_by_role("button", name="hand forward: W").click()
    driver.press("KeyY")
    page.get_by_role("button", name="hand forward: Y").click()
    driver.press("Space")
    driver.expect_phase("STOPPED")
    driver.press("Enter")  # taken as the key of the hand
    driver.at("help-reset").click()
    driver.press("KeyH")
    driver.press("Enter")
    driver.expect_phase("ready: press Start")


def test_sliders_take_the_arm_from_where_it_is(on_bench):
    made, driver = on_bench("direct", viewport={"width": 1280, "height": 720})
    page = driver.page
    for seed in (0, 1):
        if seed:
            made.begin(seed)
        driver.begin()
        track = page.locator("#sliders .track").nth(1)
        track.scroll_into_view_if_needed()
        page.wait_for_timeout(300)
        box = track.bounding_box()
        arm = made.arm
        page.mouse.move(box["x"] + 0.9 * box["width"], box["y"] + 4)  # far from where its knob is
        page.mouse.down()
        held = made.wait(lambda intent: intent.raw.device == "sliders" and intent.raw.axes)
        assert np.abs(held.raw.values[-len(arm) :] - arm).max() < 2e-3  # nothing jumps
        page.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + 4)
        moved = made.wait(lambda intent, arm=arm: abs(intent.raw.values[-len(arm) + 1] - arm[1]) > 0.1)
        assert moved.raw.values[-len(arm) + 1] < arm[1]
        assert np.flatnonzero(np.abs(moved.values) > 1e-2).tolist() == [len(moved.values) - len(arm) + 1]
        shoot(page, "sliders")
        page.mouse.up()
        made.wait(lambda intent: not intent.values.any())


def test_an_arrow_held_since_before_moves_no_slider(on_bench):
    made, driver = on_bench("direct", viewport={"width": 1280, "height": 720})
    driver.begin()
    track = driver.page.locator("#sliders .track").nth(1)
    track.focus()
    driver.page.keyboard.down("ArrowRight")
    made.wait(lambda intent: intent.values.any())
    track.blur()
    made.wait(lambda intent: not intent.values.any())
    track.focus()
    for _ in range(5):
        driver.page.keyboard.down("ArrowRight")  # the same key, still down: a repeat
        assert not made.wait(lambda intent: True).values.any()
    driver.page.keyboard.up("ArrowRight")
    driver.page.keyboard.down("ArrowRight")
    made.wait(lambda intent: intent.values.any())


def test_any_mask_is_chosen_and_a_mode_goes_back(on_bench):
    made, driver = on_bench(viewport={"width": 1280, "height": 720})
    page = driver.page
    driver.begin()
    before = made.wait(lambda intent: True).mask
    page.get_by_role("button", name="you own the base").click()
    both = made.wait(lambda intent: intent.mask.sum() == before.sum() + 3)
    assert both.mode.startswith("mask:")
    page.get_by_text("More", exact=True).click()
    page.get_by_text("Single channels").click()
    page.get_by_role("button", name="hand down, hand up").click()
    made.wait(lambda intent: intent.mask.sum() == both.mask.sum() - 1)
    shoot(page, "mask")
    driver.at("one-joint").select_option(label="elbow")
    alone = made.wait(lambda intent: intent.mask.sum() == 1)
    page.keyboard.down("Digit3")
    made.wait(moves(int(np.flatnonzero(alone.mask)[0])))
    page.keyboard.up("Digit3")
    driver.choose("mode", "ee")
    assert (made.wait(lambda intent: intent.mode == "ee").mask == before).all()


def test_a_device_with_a_pose_leads_the_hand_while_it_is_held_and_tracked(on_bench):
    made, driver = on_bench(script=XR)
    page = driver.page
    driver.begin()
    page.locator("#xr").click()
    expect(driver.at("frame")).to_have_value("world")
    forward = 3  # after the base's three
    page.evaluate("pose.transform.position.z = -0.5")
    page.wait_for_timeout(300)
    assert at_rest(made.wait(lambda intent: True))  # not held
    page.evaluate("press('selectstart')")
    page.wait_for_timeout(300)
    assert at_rest(made.wait(lambda intent: True))  # it has not moved since the press
    page.evaluate("pose.transform.position.z = -0.55")
    led = made.wait(moves(forward))
    assert led.raw.device == "xr"
    assert led.raw.values[forward] == pytest.approx(8 * 0.05, abs=0.01)
    half = math.radians(10) / 2
    page.evaluate("pose.transform.position.z = -0.5")
    turn = {"x": 0, "y": math.sin(half), "z": 0, "w": math.cos(half)}
    page.evaluate("(turn) => { pose.transform.orientation = turn; }", turn)
    turned = made.wait(moves(forward + 5))  # about the vertical
    assert turned.raw.values[forward + 5] > 0.0
    page.evaluate("pose.emulatedPosition = true")
    made.wait(at_rest)
    page.evaluate("pose.emulatedPosition = false")
    page.wait_for_timeout(300)
    assert at_rest(made.wait(lambda intent: True))  # until it is pressed anew
    page.evaluate("press('selectend')")


def test_a_device_that_is_centred_anew_moves_nothing_until_it_is_pressed_again(on_bench):
    made, driver = on_bench(script=XR)
    page, forward = driver.page, 3
    driver.begin()
    page.locator("#xr").click()
    expect(driver.at("frame")).to_have_value("world")
    for before, after in ((0.0, -0.05), (0.4, 0.35)):
        page.evaluate("(z) => { pose.transform.position.z = z; press('selectstart'); }", before)
        page.wait_for_timeout(300)
        page.evaluate("(z) => { pose.transform.position.z = z; }", after)
        led = made.wait(moves(forward))
        assert led.raw.values[forward] == pytest.approx(8 * 0.05, abs=0.01)
        page.evaluate("space.dispatchEvent(new Event('reset')); pose.transform.position.z = 0.4")
        made.wait(at_rest)
        page.wait_for_timeout(300)
        assert at_rest(made.wait(lambda intent: True))
        expect(driver.at("notice")).to_contain_text("lost its place")


def test_thumbs_reach_sticks_and_a_lost_pointer_lets_go(on_bench):
    made, driver = on_bench(**PHONE)
    page = driver.page
    driver.at("hint-close").tap()
    driver.at("start").tap()
    driver.expect_phase("recording")
    boxes = {side: page.locator(f'.stick[data-axes="{side}"]').bounding_box() for side in ("left", "right")}
    assert boxes["left"]["x"] < 30
    assert boxes["right"]["x"] + boxes["right"]["width"] > 844 - 30
    points = [
        {"x": box["x"] + box["width"] / 2, "y": box["y"] + 4, "id": number}
        for number, box in enumerate(boxes.values())
    ]
    touch = page.context.new_cdp_session(page)
    touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": points})
    both = made.wait(lambda intent: intent.raw.axes == 2)
    assert both.raw.device == "touch"
    shoot(page, "phone-both-thumbs")
    touch.send("Input.dispatchTouchEvent", {"type": "touchCancel", "touchPoints": []})
    made.wait(at_rest)


@pytest.mark.parametrize("control", ["mode", "speed", "practice", "pause"])
def test_the_stop_works_wherever_the_focus_is(on_bench, control):
    _, driver = on_bench()
    driver.begin()
    focus = "(id) => { const it = document.getElementById(id); it.disabled = false; it.focus(); }"
    driver.page.evaluate(focus, control)
    driver.press("Space")
    driver.expect_phase("STOPPED")
