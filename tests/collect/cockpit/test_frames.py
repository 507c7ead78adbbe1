"""A law of what the page is shown: each moment is JSON that a browser reads, whatever was before."""

import json
from collections import Counter
from types import SimpleNamespace

import numpy as np
from collect_helpers import environment

from handrail.collect.cockpit.cockpit import Cockpit
from handrail.collect.cockpit.pipe import Kind
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import View


class SilentServer:
    """Keeps what it is sent; nobody looks at it."""

    def __init__(self):
        self.frames, self.pipe = [], self
        self.dropped = Counter()

    def send(self, kind, value):
        if kind is Kind.FRAME:
            self.frames.append(value)

    def send_surely(self, kind, value, instead_of=()):
        pass

    def keep(self, name, data):
        pass

    def drop(self, name):
        pass

    def receive(self):
        return []


def test_the_first_moment_of_a_second_episode_is_json():
    server = SilentServer()
    with environment("Reach") as env:
        cockpit = Cockpit(env.model, {"ee": MODES["ee"]}, "ee", server)
        for seed in range(2):
            observation, _ = env.reset(seed=seed)
            view = View(env.plant.state(), env.task_state(), observation)
            cockpit.begin(env, seed)
            cockpit.reset(view, np.random.default_rng(seed))
            cockpit.act(view)
            cockpit.see(SimpleNamespace(commanded=0.02, wall_clock=0.01, images={}, number=0))
    assert len(server.frames) == 2
    for frame in server.frames:
        assert frame["mode"] == "ee"
        json.dumps(frame, allow_nan=False)
