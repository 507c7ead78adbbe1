"""A cockpit whose robot stands still: what a page does becomes intents that a test can look at."""

import threading
import time
from contextlib import contextmanager

import numpy as np
from collect_helpers import environment

from handrail.collect.cockpit.cockpit import Cockpit
from handrail.collect.cockpit.pipe import Kind
from handrail.collect.cockpit.process import ServerProcess
from handrail.collect.cockpit_config import CockpitConfig
from handrail.collect.config import RecordConfig
from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.operators.person.person import Person
from handrail.collect.session.build import build_modes
from handrail.controllers.interface.intent import Intent

_PERIOD = 0.05  # [s]


class Bench:
    """A cockpit, asked 20 times a second as a session asks it.

    Args:
        env: of the robot.
        mode: at the beginning.

    Attributes:
        intent: the newest one; None while the person does not drive.
        events: what was said of the episode, pauses left out.
        address: of the page.
        card: to be shown next, by the thread that has the server.
    """

    def __init__(self, env, mode):
        modes = build_modes(RecordConfig(task="reach"), env)
        self._env, self._server = env, ServerProcess(CockpitConfig(port=0, open=False))
        self.address, self.card = self._server.address, None
        self.cockpit = Cockpit(Person(env.model, modes, mode), self._server)
        self.intent, self.events, self.seed = None, [], 0
        self._over, self._is_begun = threading.Event(), True
        self._thread = threading.Thread(target=self._run)

    def begin(self, seed=0):
        """Begin an episode: the robot stands elsewhere."""
        self.seed, self._is_begun = seed, False
        while not self._is_begun and self._thread.is_alive():
            time.sleep(0.02)

    def start(self):
        self._begin()
        self._thread.start()

    def close(self):
        if not self._over.is_set():
            self._over.set()
            self._thread.join()
            self.cockpit.close()

    @property
    def robot(self):
        return self._env.model.description.name

    @property
    def arm(self):
        """Where the arm's joints are [rad]."""
        return self._env.plant.state().q[3:]

    def view(self):
        return View(self._env.plant.state(), self._env.task_state())

    def wait(self, come, patience=20.0):
        """Wait until something of the intent is so; return the intent."""
        end = time.monotonic() + patience
        while time.monotonic() < end:
            intent = self.intent
            if intent is not None and come(intent):
                return intent
            time.sleep(0.02)
        raise AssertionError(f"never came; the newest is {self.intent}")

    def _begin(self):
        self._env.reset(seed=self.seed)
        self.cockpit.begin(self._env, self.seed)
        self.cockpit.reset(self.view(), np.random.default_rng(0))
        self._is_begun = True

    def _run(self):
        while not self._over.wait(_PERIOD):
            if not self._is_begun:
                self._begin()
            if card := self.card:
                self._server.pipe.send_surely(Kind.CARD, card)
                self.card = None
            answer = self.cockpit.act(self.view())
            self.intent = answer if isinstance(answer, Intent) else None
            if isinstance(answer, EpisodeEvent) and answer is not EpisodeEvent.PAUSE:
                self.events.append(answer)


@contextmanager
def bench(mode="ee", **options):
    """Run a cockpit on a bench."""
    with environment("Reach", render_mode="rgb_array", **options) as env:
        made = Bench(env, mode)
        made.start()
        try:
            yield made
        finally:
            made.close()
