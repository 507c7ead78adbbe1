"""What the tests of the real page share: Chromium, and pages that may not have an error."""

from pathlib import Path

import pytest

try:
    from page_driver import CHROMIUM, browser
except ImportError:  # Playwright comes with the extra 'dev'
    CHROMIUM, browser = (), None
    collect_ignore_glob = ["*/test_page_*.py", "*/test_attacks.py"]


@pytest.fixture(scope="session")
def chromium():
    program = next((path for path in CHROMIUM if Path(path).exists()), None)
    if browser is None or program is None:
        pytest.skip("needs Playwright (extra 'dev') and Chromium: " + " or ".join(CHROMIUM))
    with browser(program) as made:
        yield made


@pytest.fixture
def new_page(chromium):
    """Make pages, each as if in a browser of its own."""
    contexts, errors = [], []

    def make(script="", **options):
        context = chromium.new_context(**({"viewport": {"width": 960, "height": 540}} | options))
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        if script:
            page.add_init_script(script)
        return page

    yield make
    for context in contexts:
        context.close()
    assert not errors


@pytest.fixture
def pad():
    """Plug a gamepad of SDL's in."""
    from device_players import VirtualPad

    from handrail.collect.devices.gamepad import Gamepad
    from handrail.controllers.errors import HandrailError

    made = VirtualPad()
    with pytest.raises(HandrailError):  # also begins SDL
        Gamepad().open()
    made.plug_in()
    yield made
    made.unplug()
