"""What the tests of the real page share: a cockpit on a bench, and its page."""

from contextlib import ExitStack

import pytest


@pytest.fixture
def on_bench(new_page):
    """Open pages, each of a cockpit whose robot stands still; give the cockpit and who looks at it."""
    from cockpit_bench import bench
    from page_driver import PageDriver

    with ExitStack() as stack:

        def opened(mode="ee", **options):
            made = stack.enter_context(bench(mode))
            return made, PageDriver(new_page(**options), made.address)

        yield opened
