"""Laws of the page in any browser: it says no more than it may, and drives where nothing may be kept."""

import pytest

pytestmark = pytest.mark.slow
FAST = """
window.sent = 0;
window.WebSocket = class extends WebSocket {
  constructor(...given) {
    super(...given);
    const isFrame = (data) => typeof data === "string" && data.includes('"kind":"frame"');
    this.addEventListener("message", ({data}) => { if (isFrame(data)) this.newest = data; });
    setInterval(() => { if (this.newest) this.onmessage({data: this.newest}); }, 10);
  }
  send(data) { sent += 1; super.send(data); }
};
window.repeat = () => document.body.dispatchEvent(
  new KeyboardEvent("keydown", {code: "KeyW", repeat: true, bubbles: true}));
"""
COUNTED = """async () => {
  const before = sent, repeats = setInterval(repeat, 33);
  await new Promise((done) => setTimeout(done, 4000));
  clearInterval(repeats);
  return sent - before;
}"""
DENIED = """for (const name of ["localStorage", "sessionStorage"])
  Object.defineProperty(window, name, {get() { throw new DOMException("denied", "SecurityError"); }});"""


def test_a_page_of_a_fast_robot_says_no_more_than_it_may(on_bench):
    """At 100 Hz, while a key is held and repeats: beyond 150 messages a second it is cut off."""
    made, driver = on_bench(script=FAST)
    driver.begin()
    driver.page.keyboard.down("KeyW")
    made.wait(lambda intent: intent.raw.axes == 1)
    assert driver.page.evaluate(COUNTED) < 4 * 140


def test_a_browser_that_keeps_nothing_drives_and_holds_on_to_changed_keys(on_bench):
    made, driver = on_bench(script=DENIED)
    driver.press("KeyH")
    driver.page.get_by_role("button", name="hand forward: W").click()
    driver.press("KeyY")
    driver.press("KeyH")
    made.begin(1)  # another episode
    driver.begin()
    driver.page.keyboard.down("KeyY")
    made.wait(lambda intent: intent.raw.axes == 1)
