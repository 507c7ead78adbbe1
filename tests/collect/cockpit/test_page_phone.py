"""Laws of the real page on a phone held sideways: thumbs on two sticks drive, and lifting them stops."""

from contextlib import contextmanager

import numpy as np
import pytest

pytest.importorskip("playwright.sync_api", reason="the extra 'dev' is not installed")
from page_driver import PageDriver
from page_recording import recording, saved
from playwright.sync_api import expect

pytestmark = pytest.mark.slow
PHONE = {"viewport": {"width": 844, "height": 390}, "has_touch": True, "is_mobile": True}


@contextmanager
def thumb(page, side, x, y):
    """Hold a thumb on a stick, as far to the right and up as said, from −1 to 1."""
    box = page.locator(f'.stick[data-axes="{side}"]').bounding_box()
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    point = {"x": middle[0] + 0.45 * x * box["width"], "y": middle[1] - 0.45 * y * box["height"]}
    session = page.context.new_cdp_session(page)
    session.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [point]})
    yield
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})


def test_thumbs_drive(new_page, tmp_path):
    with recording(tmp_path / "d", "--task", "reach", "--dataset.num_episodes", 1) as (process, address):
        driver = PageDriver(new_page(**PHONE), address)
        page = driver.page
        expect(driver.at("sticks")).to_be_visible()
        for name in ("start", "stop", "phase", "success"):
            expect(driver.at(name)).to_be_in_viewport()
        driver.expect_phase("ready: press Start")
        driver.at("start").tap()
        driver.expect_phase("recording")
        start = driver.settled()
        with thumb(page, "left", 0.0, -1.0):
            page.wait_for_timeout(900)
        back = driver.settled()
        assert np.linalg.norm(back[:2] - start[:2]) > 0.05
        assert np.abs(driver.settled() - back).max() < 0.003  # it stands still
        with thumb(page, "right", 0.0, -1.0):
            page.wait_for_timeout(600)
        assert driver.settled()[2] < back[2] - 0.02
        driver.at("success").tap()
        driver.page.locator("[data-answer=success]").tap()
        assert process.wait(60) == 0
    (frames,) = saved(tmp_path / "d")
    assert "touch" in frames["teleop.device"]
