"""Laws of what the page says: each state has its words and look; `HANDRAIL_SHOTS` keeps pictures."""

import os
import signal

import pytest
from page_driver import LOST
from page_recording import family
from page_shots import shoot
from playwright.sync_api import expect

pytestmark = pytest.mark.slow
SIZES = {
    "1280": {"viewport": {"width": 1280, "height": 720}},
    "1920-dark": {"viewport": {"width": 1920, "height": 1080}, "color_scheme": "dark"},
    "phone": {"viewport": {"width": 844, "height": 390}, "has_touch": True, "is_mobile": True},
}

SOCKET = """
window.WebSocket = class extends WebSocket {
  constructor(...given) { super(...given); window.socket = this; }
};
"""


@pytest.mark.parametrize("size", SIZES)
def test_states_of_driving(on_bench, size):
    made, driver = on_bench(**SIZES[size])
    page = driver.page
    driver.expect_phase("ready: press Start")
    assert "seen" not in page.evaluate("JSON.stringify(localStorage)")
    shoot(page, f"ready-{size}")
    page.locator("#hint-close").click()
    assert page.locator("#hint").is_hidden()
    for name in ("start", "pause", "undo", "success", "failure", "stop"):
        expect(driver.at(name)).to_be_in_viewport(ratio=1.0)
    assert page.evaluate("document.documentElement.scrollHeight <= innerHeight")
    driver.press("KeyH")
    shoot(page, f"help-{size}")
    driver.press("KeyH")
    driver.begin()
    page.keyboard.down("KeyW")
    made.wait(lambda intent: intent.raw.axes == 1)
    shoot(page, f"driving-{size}")
    page.evaluate("dispatchEvent(new Event('blur'))")
    driver.expect_phase(LOST)
    expect(driver.at("banner")).to_contain_text("Let go of everything")
    shoot(page, f"lost-{size}")
    page.keyboard.up("KeyW")
    page.evaluate("dispatchEvent(new Event('focus'))")
    driver.expect_phase("recording")
    driver.press("KeyP")
    driver.expect_phase("paused")
    shoot(page, f"paused-{size}")
    driver.press("Space")
    driver.expect_phase("STOPPED")
    expect(driver.at("start")).to_contain_text("Release")
    shoot(page, f"stopped-{size}")


def test_a_refused_message_is_said_on_the_page_and_a_cut_is_seen(on_bench):
    _, driver = on_bench(script=SOCKET)
    page = driver.page
    page.evaluate("socket.send('garbage')")
    expect(driver.at("notice")).to_contain_text("expected JSON")
    shoot(page, "error")
    page.evaluate("() => { window.WebSocket = class { static OPEN = 1; readyState = 0; close() {} }; }")
    page.evaluate("socket.close()")
    driver.expect_phase("no connection")
    shoot(page, "reconnecting")


def test_a_page_that_hears_nothing_new_says_so(on_bench):
    _, driver = on_bench()
    driver.begin()
    (server,) = (
        pid for pid, words in family(os.getpid()).items() if "handrail.collect.cockpit.server" in words
    )
    os.kill(server, signal.SIGSTOP)
    try:
        driver.expect_phase("nothing new")
        expect(driver.at("banner")).to_contain_text("What you see is old")
    finally:
        os.kill(server, signal.SIGCONT)
    expect(driver.at("phase")).not_to_have_text("nothing new")
    driver.press("KeyP")
    driver.expect_phase("paused")
    driver.page.wait_for_timeout(4000)  # a pause is no silence
    assert driver.phase == "paused"


@pytest.mark.parametrize("trouble", ["", "no room"])
def test_the_end_says_whether_it_was_an_error(on_bench, trouble):
    made, driver = on_bench()
    driver.expect_phase("ready: press Start")
    made.cockpit.trouble = trouble
    made.close()
    expect(driver.page.locator("body")).to_have_attribute("data-phase", "failed" if trouble else "over")
    expect(driver.at("banner")).to_contain_text(f"an error: {trouble}" if trouble else "Recording is over")


def test_a_countdown_starts_the_episode_and_any_action_ends_it(on_bench):
    _, driver = on_bench()
    driver.at("countdown-wanted").check()
    driver.press("Enter")
    expect(driver.at("countdown")).to_be_visible()
    shoot(driver.page, "countdown")
    driver.press("Space")
    assert driver.at("countdown").is_hidden()
    driver.expect_phase("STOPPED")
    driver.press("Enter")
    driver.expect_phase("ready: press Start")


def test_the_page_works_with_any_memory_of_the_browser(on_bench):
    """Text that is no JSON, another kind of value, an older page's keys, keys without a stop."""
    made, driver = on_bench()
    names = ["handrail:hint", "handrail:countdown", "handrail:sticks", f"handrail:map:{made.robot}"]
    for kept in ("{", "[]", '{"keys": 3, "actions": {"stop": "KeyX"}}', '[["KeyW", "no.such", 1]]'):
        script = "([names, kept]) => names.forEach((name) => localStorage.setItem(name, kept))"
        driver.page.evaluate(script, [names, kept])
        driver.page.reload()
        expect(driver.at("numbers")).not_to_be_empty()
        made.begin(made.seed + 1)
        driver.begin()
        driver.page.keyboard.down("KeyW")
        made.wait(lambda intent: intent.raw.axes == 1)
        driver.page.keyboard.up("KeyW")
        driver.press("Space")
        driver.expect_phase("STOPPED")
        driver.press("Enter")
        driver.expect_phase("paused")
