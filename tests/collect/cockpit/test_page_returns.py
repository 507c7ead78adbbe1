"""Laws of the real page: who comes back goes on; who comes second watches, until they are given the wheel."""

import json
import os
import signal
import time

import numpy as np
import pytest
from cockpit_helpers import heard, server, show
from cockpit_witness import Relay, closing
from page_driver import SLOW, PageDriver
from page_recording import driven, is_smooth, is_whole, recording, saved
from playwright.sync_api import expect

from handrail.collect.cockpit.pipe import Kind

pytestmark = pytest.mark.slow


def test_a_reload_in_the_middle_loses_nothing(new_page, tmp_path):
    with driven(new_page, tmp_path / "d", "--task", "reach", "--dataset.num_episodes", 1) as driver:
        start = driver.place()
        driver.push("KeyS", 1.0)
        driver.page.keyboard.down("KeyS")
        driver.page.reload()
        driver.page.keyboard.up("KeyS")
        driver = PageDriver(driver.page)
        driver.expect_phase("paused")
        expect(driver.at("start")).to_contain_text("Go on")
        driver.page.wait_for_timeout(1000)
        before = driver.settled()
        assert np.abs(before - start).max() > 0.05
        driver.push("KeyS", 0.6)  # before they go on, nothing moves
        assert np.abs(driver.settled() - before).max() < 0.003
        driver.press("Enter")
        driver.expect_phase("recording")
        driver.push("KeyS", 0.8)
        assert np.abs(driver.settled() - before).max() > 0.03
        driver.done()
    (frames,) = saved(tmp_path / "d")
    assert is_whole(frames)
    assert is_smooth(frames)
    assert not frames["next.success"][-1]  # as the judge says


def test_the_second_who_comes_watches_and_may_be_given_the_wheel(new_page, tmp_path):
    with recording(tmp_path / "d", "--task", "reach") as (process, address):
        first = PageDriver(new_page(), address)
        first.begin()
        second = PageDriver(new_page(), address)
        assert "You watch" in second.text("drives")
        start = second.settled()
        second.push("KeyS", 0.6)
        second.press("ArrowRight")
        assert np.abs(second.settled() - start).max() < 0.003
        assert second.text("saved").startswith("0 saved")
        second.page.get_by_role("button", name="Ask to drive").click()
        first.page.get_by_role("button", name="Let them").click()
        second.expect_phase("paused")
        second.press("Enter")
        second.expect_phase("recording")
        first.push("KeyF", 0.6)  # it is no longer theirs
        assert np.abs(second.settled() - start).max() < 0.003
        second.push("KeyS", 0.8)
        assert np.abs(second.settled() - start).max() > 0.03
        second.end(save="ArrowDown")
        assert process.wait(60) == 0


def test_the_page_says_stop_until_it_is_so(new_page):
    """Also when the connection breaks meanwhile; it is the same press all the time, and all that is said."""
    with server() as served, closing(Relay(served.address)) as relay:
        page, said = new_page(), []
        page.on(
            "websocket", lambda socket: socket.on("framesent", lambda text: said.append(json.loads(text)))
        )
        with page.expect_websocket(timeout=SLOW):
            page.goto(relay.address)
        page.wait_for_timeout(1000)
        page.locator("#stop").click()
        for _ in range(2):
            before, end = len(said), time.monotonic() + 60.0
            relay.break_off()
            while len(said) < before + 3:
                assert time.monotonic() < end, said
                page.wait_for_timeout(100)
        assert heard(served, {Kind.STOP}, 2, patience=1.0) == [(Kind.STOP, None)]
        show(served, phase="stopped")
        page.wait_for_timeout(1000)
        before = len(said)
        page.wait_for_timeout(1000)
        assert len(said) == before
        assert {each["what"] for each in said} == {"stop"}
        assert len({each["press"] for each in said}) == 1
        page.close()


def test_the_door_opens_to_the_address_with_the_token_and_asks_again(new_page):
    """In the same tab; a session that has ended is no broken connection."""
    with server(token=True) as made:
        page = new_page()
        page.goto(made.address.split("#")[0])
        expect(page.locator("#door")).to_be_visible()
        with page.expect_websocket(timeout=SLOW):
            page.goto(made.address)
        expect(page.locator("#door")).to_be_hidden()
        page.context.clear_cookies()
        os.kill(made.process.pid, signal.SIGKILL)
        heard(made, {Kind.NOTE})  # another one begins
        expect(page.locator("#door")).to_be_visible()
