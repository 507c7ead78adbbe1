"""Laws of the first use: what `make demo` says leads to driving, and all there is to read takes a minute."""

import re

import pytest

pytest.importorskip("playwright.sync_api", reason="the extra 'dev' is not installed")
from page_driver import PageDriver
from page_recording import recording, saved

from handrail.collect.commands.demo import NEXT

pytestmark = pytest.mark.slow
A_MINUTE = 200  # words that somebody reads whose first language is another
_READ = """() => [...document.querySelectorAll("header, #choices, footer, #episodes-box")].map((part) => {
  const copy = part.cloneNode(true);
  for (const hidden of copy.querySelectorAll("option, #numbers, details > :not(summary)")) hidden.remove();
  return copy.textContent;
}).join(" ")"""


def words(text):
    return re.findall(r"[A-Za-z][a-z']+", text)


def test_from_the_demo_to_driving(new_page, tmp_path):
    first = NEXT.splitlines()[1]
    assert first.split()[0] == "{bin}handrail-cockpit"
    with recording("", cwd=tmp_path) as (process, address):
        driver = PageDriver(new_page(), address)
        driver.expect_phase("ready: press Start", 180_000)
        on_page = words(driver.page.evaluate(_READ) + driver.text("hint"))
        driver.press("KeyH")
        card = words(driver.text("help-table"))
        driver.press("KeyH")
        driver.press("Enter")
        driver.expect_phase("recording")
        start = driver.place()
        driver.push("KeyW", 1.0)
        assert driver.wait(lambda: abs(driver.place() - start).max() > 0.05)
        driver.done()
        driver.end()
        _, said = process.communicate(timeout=60)
    counts = {"demo": len(words(first)), "page": len(on_page), "card": len(card)}
    print("words to read:", counts)
    assert sum(counts.values()) <= A_MINUTE
    assert len(saved(tmp_path / "outputs" / "cockpit" / "reach")) == 1
    assert "outputs/cockpit/reach" in said
    assert "handrail-inspect outputs/cockpit/reach" in said
