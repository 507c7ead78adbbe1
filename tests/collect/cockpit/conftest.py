"""What the tests of the cockpit share: a server without a robot, and a cockpit on a bench with its page."""

from contextlib import ExitStack

import pytest
from cockpit_helpers import connected, server, stage


@pytest.fixture(scope="module")
def served():
    """A server whose recording has said what there is to draw."""
    with server() as made:
        stage(made)
        yield made


@pytest.fixture
def ends():
    both = connected()
    yield both
    for each in both:
        each.close()


@pytest.fixture
def on_bench(new_page):
    """Open pages, each of a cockpit whose robot stands still; give the cockpit and who looks at it."""
    from cockpit_bench import bench
    from page_driver import PageDriver

    with ExitStack() as stack:

        def opened(mode="ee", robot="ridgeback_ur10", **options):
            made = stack.enter_context(bench(mode, robot=robot))
            return made, PageDriver(new_page(**options), made.address)

        yield opened
