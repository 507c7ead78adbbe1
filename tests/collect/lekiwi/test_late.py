"""A LeKiwi goes on as it was told last: what is late, in the loop or the network, makes it touch nothing."""

import logging

import pytest
from lekiwi_helpers import FarClient, rude_drive

from handrail.collect.lekiwi.link import Link
from handrail.controllers.numerics.threads import single_threaded
from handrail.controllers.robot.model import load_model


@pytest.mark.parametrize("seeds", [1, pytest.param(12, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("gap", "latency", "drop"), [(0.25, 0, 0), (0.45, 0, 0), (1, 0, 0), (0, 0.1, 0.1)])
def test_delays_touch_nothing(gap, latency, drop, seeds):
    with single_threaded():
        found = [rude_drive(gap, latency, drop, seed, seconds=10.0) for seed in range(seeds)]
    assert not any(contacts for contacts, _ in found)
    assert gap or found[0][1] > 0.3  # a robot that never moves touches nothing, too


def test_a_base_whose_next_command_is_late_is_sent_the_stop_and_that_is_said(caplog):
    client = FarClient(0.0, 0.0, 0)
    link = client.link = Link(client, "lekiwi", load_model("lekiwi"), 0.05, False, client.clock, client.sleep)
    for _ in range(10):
        link.exchange([0.1, 0, 0, 0, 0, 0, 0, 0, 0])
    assert client.body.speed > 0.08
    client.sleep(0.45)  # less than the host's watchdog takes
    assert client.body.speed < 0.01
    with caplog.at_level(logging.WARNING):
        link.close()
    assert "commands were late" in caplog.text
