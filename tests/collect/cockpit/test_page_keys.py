"""Laws of keys and fingers: what is let go moves nothing, STOP is heard, the page says what a key is."""

import numpy as np
import pytest
from playwright.sync_api import expect

from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.model import load_model

pytestmark = pytest.mark.slow
PHONE = {"viewport": {"width": 844, "height": 390}, "has_touch": True, "is_mobile": True}
FRENCH = """Object.defineProperty(navigator, "keyboard", {value: {getLayoutMap: async () => new Map(
  [["KeyW", "z"], ["KeyA", "q"], ["KeyZ", "w"], ["KeyQ", "a"], ["Digit1", "&"]])}});"""
ITEM = {
    "name": "how",
    "kind": "scale",
    "text": "How?",
    "least": 1,
    "most": 5,
    "step": 1,
    "low": "",
    "high": "",
}
CARD = {"id": "P001/x", "title": "T", "text": [], "keys": [], "items": [], "answers": {}, "last": False}
CARD |= {"note": "", "error": "", "pause": False}


def middle(driver, selector):
    box = driver.page.locator(selector).bounding_box()
    return {"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 4}


@pytest.mark.parametrize(("button", "phase"), [("stop", "STOPPED"), ("pause", "paused")])
def test_a_second_finger_presses_buttons_while_the_first_steers(on_bench, button, phase):
    made, driver = on_bench(**PHONE)
    driver.at("hint-close").tap()
    driver.at("start").tap()
    driver.expect_phase("recording")
    touch = driver.page.context.new_cdp_session(driver.page)
    thumb = middle(driver, '.stick[data-axes="left"]') | {"id": 0}
    finger = middle(driver, f"#{button}") | {"id": 1}
    for kind, points in (("touchStart", [thumb]), ("touchStart", [thumb, finger]), ("touchEnd", [])):
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        if len(points) == 1:
            made.wait(lambda intent: intent.raw.axes)
    driver.expect_phase(phase)


def test_a_key_held_while_the_page_was_not_in_front_has_to_go_up_first(on_bench):
    made, driver = on_bench()
    keys = driver.page.keyboard
    driver.begin()
    keys.down("KeyW")
    made.wait(lambda intent: intent.raw.axes == 1)
    driver.page.evaluate("dispatchEvent(new Event('blur'))")
    driver.expect_phase("no input: let go of everything")
    driver.page.evaluate("dispatchEvent(new Event('focus'))")
    driver.expect_phase("recording")
    keys.down("KeyW")  # a repetition
    driver.page.wait_for_timeout(300)
    assert made.intent.raw.axes == 0
    keys.up("KeyW")
    keys.down("KeyW")
    made.wait(lambda intent: intent.raw.axes == 1)


def test_nothing_is_held_once_a_meta_key_is_down(on_bench):
    """On macOS no page hears of a key that goes up meanwhile."""
    made, driver = on_bench()
    driver.begin()
    driver.page.keyboard.down("KeyW")
    made.wait(lambda intent: intent.raw.axes == 1)
    driver.page.keyboard.down("Meta")
    made.wait(lambda intent: intent.raw.axes == 0)


@pytest.mark.parametrize("button", ["left", "right"])
def test_nothing_is_held_once_a_list_or_a_menu_is_open(on_bench, button):
    """The browser gives it all keys, also those that go up."""
    made, driver = on_bench()
    driver.begin()
    driver.page.keyboard.down("KeyW")
    made.wait(lambda intent: intent.raw.axes == 1)
    driver.page.locator("#mode" if button == "left" else "#said").click(button=button, force=True)
    made.wait(lambda intent: intent.raw.axes == 0)


@pytest.mark.parametrize("with_key", ["Control", "Alt", "Shift"])
def test_the_stop_counts_with_another_key_too(on_bench, with_key):
    _, driver = on_bench()
    driver.begin()
    driver.press(f"{with_key}+Space")
    driver.expect_phase("STOPPED")


def test_the_stop_does_not_wait_until_the_mouse_button_goes_up(on_bench):
    _, driver = on_bench()
    driver.begin()
    driver.page.locator("#stop").hover()
    driver.page.mouse.down()
    driver.expect_phase("STOPPED")
    driver.page.mouse.up()
    driver.page.wait_for_timeout(300)
    driver.expect_phase("STOPPED")


def test_a_key_that_stays_down_is_one_press_and_ticks_boxes(on_bench):
    """Without a mouse: Enter ticks, as Space is STOP; on a button it does not release the stop and go on."""
    _, driver = on_bench()
    driver.expect_phase("ready: press Start")
    driver.at("countdown-wanted").focus()
    driver.press("Enter")
    assert driver.at("countdown-wanted").is_checked()
    driver.press("Enter")
    assert not driver.at("countdown-wanted").is_checked()
    driver.page.locator("#said").click(force=True)
    driver.press("Space")
    driver.expect_phase("STOPPED")
    driver.at("start").focus()
    for _ in range(3):
        driver.page.keyboard.down("Enter")
        driver.expect_phase("ready: press Start")
        driver.page.wait_for_timeout(500)
    driver.expect_phase("ready: press Start")


def test_slower_is_never_faster(on_bench):
    _, driver = on_bench()
    expect(driver.at("speed-said")).to_have_text("60 %")
    said = [60]
    for _ in range(5):
        driver.press("Minus")
        driver.page.wait_for_timeout(300)
        said.append(round(100 * driver.speed))
    assert said == sorted(said, reverse=True)
    assert said[-1] == 10


def test_keys_are_called_as_the_keyboard_calls_them(on_bench):
    made, driver = on_bench(script=FRENCH)
    assert "Z S forward, Q D sideways" in driver.text("hint-words")
    driver.press("KeyH")
    expect(driver.page.get_by_role("button", name="hand forward: Z")).to_be_visible()
    driver.press("KeyH")
    driver.begin()
    driver.page.keyboard.down("KeyW")  # the key in that place
    assert made.wait(lambda intent: intent.raw.axes == 1).raw.device == "keyboard"


def test_a_question_is_answered_by_arrow_keys(on_bench):
    made, driver = on_bench()
    made.card = CARD | {"items": [ITEM]}
    radios = driver.page.locator("#study input[type=radio]")
    radios.nth(1).focus()
    driver.press("ArrowRight")
    expect(radios.nth(2)).to_be_checked()
    assert not made.events


def channels(robot, *groups):
    known = Channels.of(load_model(robot).description)
    return [known.names[index] for index in np.flatnonzero(known.mask(*groups))]


@pytest.mark.parametrize(
    ("robot", "mode", "groups", "rows"),
    [
        ("ridgeback_ur10", "ee", ("ee",), ("W hand forward",)),
        ("ridgeback_ur10", "direct", ("joint",), ("I base forward", "1 shoulder pan +")),
        ("tiago_pro", "both", ("ee",), ("W left hand forward", "I right hand forward")),
        ("tiago_pro", "pair", ("pair", "apart"), ("W both hands: forward", "0 hands apart")),
    ],
)
def test_a_card_says_the_keys_of_what_is_owned_as_they_are_now(on_bench, robot, mode, groups, rows):
    made, driver = on_bench(mode, robot)
    driver.press("KeyH")
    driver.page.get_by_role("button", name="failed: ↓").click()
    driver.press("F9")
    driver.press("KeyH")
    made.card = CARD | {"keys": channels(robot, *groups)}
    table = driver.page.locator("#study-keys")
    for row in (*rows, "F9 failed", "Enter start, pause, go on", "Space STOP"):
        expect(table).to_contain_text(row.replace(" ", "", 1))


def test_a_finger_that_stays_while_the_page_is_away_moves_nothing_after(on_bench):
    made, driver = on_bench(**PHONE)
    driver.at("hint-close").tap()
    driver.at("start").tap()
    driver.expect_phase("recording")
    touch = driver.page.context.new_cdp_session(driver.page)
    thumb = middle(driver, '.stick[data-axes="left"]')
    for event, deflected in ((None, True), ("blur", False), ("focus", False)):
        if event:
            driver.page.evaluate("(event) => dispatchEvent(new Event(event))", event)
        thumb["y"] -= 6
        kind = "touchMove" if event else "touchStart"
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [thumb]})
        if event != "blur":
            driver.page.wait_for_timeout(400)
            made.wait(lambda intent, deflected=deflected: bool(intent.raw.axes) == deflected)


def test_a_kept_key_never_takes_the_stop(on_bench):
    made, driver = on_bench()
    driver.press("KeyH")
    driver.page.get_by_role("button", name="hand forward: W").click()
    driver.press("F9")
    spoil = "(name) => { localStorage[name] = localStorage[name].replaceAll('F9', 'Space'); }"
    driver.page.evaluate(spoil, f"handrail:map:{made.robot}")
    driver.page.reload()
    expect(driver.at("numbers")).not_to_be_empty()
    made.begin(1)
    driver.begin()
    driver.press("Space")
    driver.expect_phase("STOPPED")


@pytest.mark.parametrize(
    ("refuses", "asked", "is_open"), [((), ["pause"], True), (("success",), ["success"], False)]
)
def test_only_who_may_say_done_is_asked_whether_it_is(on_bench, refuses, asked, is_open):
    script = """async (refuses) => {
      const { Decision } = await import("./decision.js"), asked = [];
      const made = new Decision((what) => asked.push(what), () => "");
      made.stage({ refuses });
      made.frame({ phase: "driving", practice: false, judge: false });
      made.success();
      return [asked, made.isOpen];
    }"""
    _, driver = on_bench()
    assert driver.page.evaluate(script, list(refuses)) == [asked, is_open]


def test_the_end_is_asked_for_though_the_episode_was_over_meanwhile(on_bench):
    """The newest picture was of the episode that was being saved: the box opened, and closes by itself."""
    script = """async () => {
      const { Decision } = await import("./decision.js"), asked = [];
      const made = new Decision((what) => asked.push(what), () => "");
      made.stage({ refuses: [] });
      for (const act of ["quit", "success"]) {
        made.frame({ phase: "driving", practice: false, judge: false });
        made[act]();
        made.frame({ phase: "ready", practice: false, judge: false });
      }
      return [asked, made.isOpen];
    }"""
    _, driver = on_bench()
    assert driver.page.evaluate(script) == [["pause", "quit", "pause"], False]


@pytest.mark.parametrize("refuses", [(), ("lock", "mask")])
def test_a_refused_mask_cannot_be_asked_for(on_bench, refuses):
    script = """async (refuses) => {
      const { Study } = await import("./study.js");
      new Study({}, () => []).stage({ refuses });
      document.getElementById("more").open = true;
      for (const each of document.querySelectorAll("#more details")) each.open = true;
      return document.getElementById("owned").inert;
    }"""
    _, driver = on_bench()
    assert driver.page.evaluate(script, list(refuses)) == bool(refuses)
    shown = [driver.at(name).is_visible() for name in ("one-joint", "channels", "locks", "numbers")]
    assert shown == [not refuses, not refuses, not refuses, True]


@pytest.mark.parametrize(
    ("now", "chip", "banner"),
    [
        ({"isDriver": False, "isConnected": True}, "you watch: practice, not recorded", ""),
        ({"isDriver": True, "isConnected": True}, "practice: not recorded", ""),
        ({"isDriver": False, "isConnected": False}, "no connection", "No connection. Trying again …"),
    ],
)
def test_watchers_are_told_the_state(on_bench, now, chip, banner):
    _, driver = on_bench()
    script = "async (now) => (await import('./states.js')).stateOf(now)"
    state = driver.page.evaluate(script, now | {"frame": {"phase": "driving", "practice": True}})
    assert (state["chip"], state["banner"]) == (chip, banner)
