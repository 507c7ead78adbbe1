"""The pictures of the cockpit in README are what the page looks like while somebody drives.

With the variable `COCKPIT_PICTURES` set to a folder, such as docs/images, they are made anew there.
"""

import os
from pathlib import Path

import page_tasks
import pytest
from page_driver import PageDriver
from page_film import PageFilm
from page_learner import Learner
from page_levers import Keys
from page_recording import recording
from PIL import Image

pytestmark = [pytest.mark.slow, pytest.mark.needs_gl]
DESK = {"viewport": {"width": 1280, "height": 720}}
PHONE = {"viewport": {"width": 844, "height": 390}, "has_touch": True, "is_mobile": True}
PERIOD, WIDTH, SECONDS = 0.6, 720, 12.0  # of the film
MOST_BYTES = 1_500_000  # of all three


def still(driver, path, key):
    """Draw the page while a key is held."""
    driver.page.keyboard.down(key)
    driver.page.wait_for_timeout(700)
    driver.page.screenshot(path=path.with_suffix(".png"), scale="css")
    driver.page.keyboard.up(key)
    picture = Image.open(path.with_suffix(".png")).convert("RGB")
    picture.save(path, quality=80, method=6)
    path.with_suffix(".png").unlink()


def test_the_pictures_of_the_page(new_page, tmp_path):
    folder = Path(os.environ.get("COCKPIT_PICTURES") or tmp_path)
    names = [folder / f"cockpit{kind}.webp" for kind in ("", "_drive", "_phone")]
    flags = ("--task", "pick_place", "--cameras", "wrist,scene", "--time_limit", 300)
    with recording("", *flags, "--dataset.num_episodes", 1, cwd=tmp_path) as (process, address):
        driver = PageDriver(new_page(**DESK), address)
        driver.begin()
        learner = Learner(driver, Keys(driver))
        driver.set_speed(1.0)
        learner.learn()
        driver.press("ArrowLeft")
        driver.begin()
        film = PageFilm(driver.page, PERIOD, DESK["viewport"]["width"])
        page_tasks.pick_place(learner)
        film.stop()
        assert process.wait(60) == 0
    film.save(names[0], WIDTH, SECONDS)
    with recording("", *flags, cwd=tmp_path) as (_, address):
        desk = PageDriver(new_page(**DESK), address)
        desk.begin()
        still(desk, names[1], "KeyA")
        desk.press("KeyP")
        desk.page.close()
    with recording("", *flags, cwd=tmp_path) as (_, address):
        phone = PageDriver(new_page(**PHONE), address)
        phone.expect_phase("ready: press Start")
        phone.at("start").tap()
        phone.expect_phase("recording")
        still(phone, names[2], "KeyA")
    with Image.open(names[0]) as film:
        assert getattr(film, "n_frames", 1) > 20
    assert 0 < sum(path.stat().st_size for path in names) < MOST_BYTES
