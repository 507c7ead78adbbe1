"""Laws of what is in view: hand and goal, nothing cut, each in its words; nothing that only experts need."""

import json
import re

import numpy as np
import pytest
from page_driver import PageDriver
from page_shots import shoot
from page_words import way
from playwright.sync_api import expect
from scipy.spatial.transform import Rotation

pytestmark = pytest.mark.slow
SIZES = [(1280, 720), (1920, 1080), (844, 390)]
_FREE = """async () => {
  const { free } = await import("./tools.js"), area = free(document.getElementById("view-tools"));
  const hit = [];
  for (let i = 1; i < 10; i += 1) for (let j = 1; j < 10; j += 1) {
    hit.push(document.elementFromPoint(area.x + area.width * i / 10, area.y + area.height * j / 10)?.id);
  }
  return { ...area, hit };
}"""
_FRAMED = """async ([width, height, points]) => {
  const { Cameras } = await import("./cameras.js"), { THREE } = await import("./three.min.js");
  const own = Cameras.prototype, { frame } = own, seen = [];
  const cameras = await new Promise((found) => { own.frame = function () { found(this); }; }); // the page's
  own.frame = frame;
  cameras.choose("follow");
  for (const [hand, goal] of points) {
    const base = new THREE.Group(), tool = new THREE.Group(), aim = new THREE.Vector3(...goal);
    tool.position.set(...hand);
    cameras.stage({ scale: 1 });
    cameras.frame(base, tool, [tool], aim);
    cameras.camera.lookAt(cameras.controls.target);
    cameras.camera.updateMatrixWorld();
    const at = [tool.position, aim].map((each) => each.clone().project(cameras.camera));
    seen.push(at.map(({ x, y }) => [(1 + x) / 2 * width, (1 - y) / 2 * height]));
  }
  return seen;
}"""


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_hand_and_goal_are_in_the_area_that_panels_leave_free(on_bench, width, height):
    phone = {"has_touch": True, "is_mobile": True} if height < 480 else {}
    _, driver = on_bench(viewport={"width": width, "height": height}, **phone)
    driver.expect_phase("ready: press Start")
    for _ in range(2):
        area = driver.page.evaluate(_FREE)
        assert set(area.pop("hit")) <= {"view", "nearest-label"}
        assert area["width"] > 0.4 * width
        assert area["height"] > 0.25 * height
        rng = np.random.default_rng(0)
        points = rng.uniform([-2, -2, 0.1], [2, 2, 1.4], (50, 2, 3)).tolist()
        seen = np.array(driver.page.evaluate(_FRAMED, [width, height, points]))
        inside = (seen - [area["x"], area["y"]]) / [area["width"], area["height"]]
        assert np.all((inside > 0.0) & (inside < 1.0))
        if driver.at("hint").is_visible():
            driver.at("hint-close").click()
        for name in ("choices-open", "episodes-open"):  # away; on a phone they are away already
            if driver.at(name).get_attribute("aria-expanded") == "true":
                driver.at(name).click()


def test_the_page_says_how_far_the_hand_is_and_how_much_turned(on_bench):
    made, driver = on_bench()
    driver.choose("frame", "world")
    state = made.view().task
    left = state.goal.position - state.tool.position
    assert driver.wait(lambda: np.abs(way(driver.text("way"))[1][:3] - left).max() < 0.006)
    said = driver.text("way")
    _, error = way(said)
    turn = np.degrees(Rotation.from_matrix(state.goal.rotation @ state.tool.rotation.T).as_rotvec())
    assert np.abs(np.degrees(error[3:]) - turn).max() < 0.6
    distance, degrees = re.search(r"([\d.]+) cm away.* turned (\d+)°", said).groups()
    assert float(distance) == pytest.approx(100 * np.linalg.norm(left), abs=0.6)
    assert float(degrees) == pytest.approx(np.linalg.norm(turn), abs=0.6)
    words = driver.page.inner_text("body")
    assert not re.search(r"[-−]0(\.0)? cm|NaN|undefined|null", words)
    assert re.search(r"nearest pair: .+ – .+, [\d.]+ cm apart", words)
    assert not re.search(r"-?\d\.\d{3} -?\d\.\d{3}", words)  # numbers are folded away


def test_an_upright_phone_is_to_be_turned_and_nothing_is_cut(on_bench):
    _, driver = on_bench(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    page = driver.page
    expect(driver.at("turn-phone")).to_contain_text("Turn your phone")
    shoot(page, "upright")
    for name in ("turn-phone", "stop"):
        expect(driver.at(name)).to_be_in_viewport(ratio=1.0)
    hit = "(y) => document.elementFromPoint(195, y)?.id"
    assert {page.evaluate(hit, y) for y in range(5, 760, 15)} == {"turn-phone"}
    driver.at("stop").tap()
    driver.expect_phase("STOPPED")
    page.set_viewport_size({"width": 844, "height": 390})
    expect(driver.at("turn-phone")).to_be_hidden()
    expect(driver.at("start")).to_be_in_viewport(ratio=1.0)


def test_esc_closes_what_is_open_and_never_becomes_a_key(on_bench):
    old = json.dumps("Escape")
    made, driver = on_bench()
    page = driver.page
    for button, asked in (("hand forward: W", "W"), ("end the recording: End", "End")):
        driver.press("KeyH")
        page.get_by_role("button", name=button).click()
        driver.press("Escape")  # it stays as it was
        expect(page.get_by_role("button", name=button)).to_have_text(asked)
        driver.press("Escape")
        expect(driver.at("help")).to_be_hidden()
    driver.press("KeyH")
    page.get_by_role("button", name="hand forward: W").click()
    driver.press("KeyY")
    driver.press("KeyH")
    name = f"handrail:map:{made.robot}"
    page.evaluate(
        f"""(name) => localStorage.setItem(name, localStorage.getItem(name).replace('"End"', '{old}'))""",
        name,
    )
    page.reload()  # an older page's keys: the person's own stay, Esc goes
    driver = PageDriver(page)
    expect(driver.at("quit")).to_contain_text("End recording End")
    driver.press("KeyH")
    expect(page.get_by_role("button", name="hand forward: Y")).to_be_visible()
    driver.press("KeyH")
