"""Laws of the picture of the real page, in Chromium: cameras, what is asked, playback, and the end."""

import json
import signal

import pytest
from page_driver import PageDriver
from page_recording import recording
from playwright.sync_api import expect

pytestmark = pytest.mark.slow
PATIENCE = 60_000  # [ms]
_SPY = """
const Plain = WebSocket;
window.frames_seen = [];
window.WebSocket = class extends Plain {
  constructor(...at) {
    super(...at);
    this.addEventListener("message", (event) => {
      if (typeof event.data !== "string") return;
      const said = JSON.parse(event.data);
      if (said.kind === "frame") window.frames_seen.push(said.frame);
    });
  }
};
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("view") / "dataset"


def shown(driver, condition, patience):
    """Wait for a frame of which something is true, as JavaScript says it; return whether one came."""
    driver.page.evaluate("() => { window.frames_seen.length = 0; }")
    return driver.wait(
        lambda: driver.page.evaluate(f"() => window.frames_seen.some((f) => {condition})"), patience
    )


def test_the_picture_from_everywhere_the_intent_playback_and_the_end(new_page, folder):
    page = new_page(_SPY)
    with recording(folder, "--task", "pick_place", "--mode", "ee") as (process, address):
        driver = PageDriver(page, address)
        cameras_can_be_chosen(driver)
        driver.begin()
        what_is_asked_leads(driver, "KeyW", "f.ghosts[0]?.length === 7")
        driver.choose("mode", "base")
        what_is_asked_leads(driver, "KeyI", "f.ghost_base.length === 3")
        driver.done()
        driver.expect_phase("ready: press Start")
        what_was_is_played(driver)
        who_drives_sees_what_is(driver)
        page.reload()
        expect(driver.at("numbers")).not_to_be_empty(timeout=PATIENCE)
        what_was_is_played(driver)
        the_end_is_said(driver, process, folder)


def cameras_can_be_chosen(driver):
    names = [option.get_attribute("value") for option in driver.at("camera").locator("option").all()]
    assert {"follow", "hand", "above", "free"} == set(names)
    before = driver.at("camera").input_value()
    driver.press("KeyV")
    expect(driver.at("camera")).not_to_have_value(before)
    for name in names:
        driver.choose("camera", name)
    driver.choose("camera", "follow")


def what_is_asked_leads(driver, key, condition):
    def leads():
        driver.page.keyboard.down(key)
        found = shown(driver, condition + " && f.paths[0]?.length > 1 && f.track.length > 1", 4.0)
        driver.page.keyboard.up(key)  # let go also where a busy computer has lost the input
        return shown(driver, "!f.ghosts[0]?.length && !f.ghost_base.length", 4.0) and found

    assert driver.wait(leads, 60.0)


def what_was_is_played(driver):
    page = driver.page
    page.locator("#episodes .play").first.click()
    expect(driver.at("playback")).to_be_visible(timeout=PATIENCE)
    before = driver.at("playback-bar").input_value()
    expect(driver.at("playback-bar")).not_to_have_value(before, timeout=PATIENCE)
    last = driver.at("playback-bar").get_attribute("max")
    driver.at("playback-bar").fill(last)
    expect(driver.at("playback-play")).to_have_text("Play")
    driver.at("playback-close").click()
    expect(driver.at("playback")).to_be_hidden()


def who_drives_sees_what_is(driver):
    driver.page.locator("#episodes .play").first.click()
    expect(driver.at("playback")).to_be_visible(timeout=PATIENCE)
    driver.begin()
    expect(driver.at("playback")).to_be_hidden(timeout=PATIENCE)


def the_end_is_said(driver, process, folder):
    process.send_signal(signal.SIGTERM)
    expect(driver.at("banner")).to_contain_text("Recording is over: 1 episode", timeout=PATIENCE)
    expect(driver.at("banner")).to_contain_text(str(folder))
    assert process.wait(60) in (0, 130)
    driver.page.wait_for_timeout(2000)  # longer than a page waits before it tries again
    expect(driver.at("banner")).to_contain_text("Recording is over")
    assert json.loads((folder / "meta" / "info.json").read_text())["total_episodes"] == 1
