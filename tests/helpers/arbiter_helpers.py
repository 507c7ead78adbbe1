"""A person and a policy that do as a test says, and the arbiters that decide between them."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.shared.arbiter import Groups, Wishes
from handrail.collect.operators.shared.catalogue import ARBITERS
from handrail.collect.operators.shared.settings import ArbiterSettings
from handrail.collect.operators.shared.shared_operator import SharedOperator
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent, RawInput
from handrail.controllers.registry import resolved
from handrail.controllers.robot.model import load_model

ONE, TWO = load_model("ridgeback_ur10"), load_model("tiago_pro")
PERIOD = 0.05


def channels_of(model):
    return Channels.of(model.description)


def arbiter(name, model=ONE, **numbers):
    """Return a new arbiter of the catalogue."""
    made = resolved(ARBITERS.find(name).build)(Groups(channels_of(model)), ArbiterSettings(**numbers))
    made.reset()
    return made


def asks(*groups, value=0.2, model=ONE, mode="base+ee", **other):
    """Return an intent that owns some groups and moves all of them with a value; 0 rests on the stick."""
    channels = channels_of(model)
    mask = channels.mask(*groups) if groups else np.zeros(channels.size, bool)
    raw = RawInput(axes=int(np.count_nonzero(value * mask)), device="stick")
    return Intent(value * mask, mask, mode=mode, **({"raw": raw} | other))


class Course:
    """The moments of an episode for an arbiter alone: each has the wishes of both, a period later."""

    def __init__(self, decides):
        self.decides, self.time = decides, 0.0

    def go(self, person, policy, seconds=0.0, realised=None, doubt=0.0):
        """Go on for some time, one moment at least; return the last shares."""
        for _ in range(max(round(seconds / PERIOD), 1)):
            self.time += PERIOD
            done = np.zeros(len(person.values)) if realised is None else realised
            shares = self.decides.shares(Wishes(self.time, person, policy, done, doubt))
        return shares


@dataclass
class Fake:
    """An operator and a policy: says what it is told to, now or of an age."""

    says: object = None
    age: float = 0.0
    doubt: float = 0.0
    calls: list = field(default_factory=list)
    plans: list = field(default_factory=list)

    def reset(self, view, rng):
        self.calls.append("reset")

    def chunk(self):
        return self.plans

    def replan(self):
        self.calls.append("replan")

    def act(self, view):
        self.calls.append("act")
        timed = isinstance(self.says, Intent)
        return replace(self.says, time=view.state.time - self.age) if timed else self.says

    @property
    def replans(self):
        return self.calls.count("replan")


class Both:
    """A shared operator with a fake person and a fake policy, at a robot that stands."""

    def __init__(self, name="by_mask", model=ONE, shares=lambda mode: True, **numbers):
        self.model, self.time = model, 0.0
        self.person, self.policy = Fake(asks(model=model)), Fake(asks("base", "ee", value=0.1, model=model))
        decides = arbiter(name, model, **numbers)
        self.operator = SharedOperator(self.person, self.policy, decides, model, shares)
        self.operator.reset(self.view(), np.random.default_rng(0))

    def view(self, q=None, v=None):
        q = self.model.description.home if q is None else q
        return View(State(q, np.zeros(self.model.size) if v is None else v, self.time), None)

    def act(self, person=None, policy=None, seconds=0.0) -> Any:
        """Let them say something, for some time; return the last answer."""
        self.person.says = self.person.says if person is None else person
        self.policy.says = self.policy.says if policy is None else policy
        for _ in range(max(round(seconds / PERIOD), 1)):
            self.time += PERIOD
            found = self.operator.act(self.view())
        return found
