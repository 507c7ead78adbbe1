"""An interrupt ends what runs, wherever it comes."""

import signal
import time
import weakref

import pytest

from handrail.controllers.interrupts import Interrupts


class Thing:
    """Something that is collected."""


def collect_and_wait(waited):
    """Let an interrupt come while something is collected, then wait."""
    thing = Thing()
    reference = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
    del thing
    assert reference() is None
    time.sleep(60)
    waited.append(True)


def test_an_interrupt_in_a_callback_of_the_collector_comes_again():
    """Python drops what is raised there; the second time it ends the program's wait."""
    waited = []
    with Interrupts(), pytest.raises(KeyboardInterrupt):
        collect_and_wait(waited)
    assert not waited
