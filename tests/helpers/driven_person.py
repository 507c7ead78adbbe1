"""A person with devices that a test moves: all of a local operator but the threads and the hardware."""

import io
from types import SimpleNamespace
from typing import Any

import numpy as np
from device_players import Clock, PlayedReader
from rich.console import Console

from handrail.collect.devices import gamepad, spacemouse
from handrail.collect.devices.calibration import LeaderCalibration, LeaderGripper, LeaderJoint
from handrail.collect.devices.control_map import ControlMap, load_map
from handrail.collect.devices.key_bytes import NAMES
from handrail.collect.devices.local_person import LocalPerson
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import View
from handrail.collect.operators.person.inputs import Ask
from handrail.collect.operators.person.person import Person
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.registry import fitting
from handrail.controllers.robot.model import Pose, load_model

MODEL = load_model()
CHANNELS = Channels.of(MODEL.description)
ARM = MODEL.description.arm_joints
HOME = np.array(MODEL.description.home)
CONTROLS = {"gamepad": gamepad.CONTROLS, "spacemouse": spacemouse.CONTROLS, "keyboard": NAMES}
FORWARD = {"gamepad": ("left_y", -1.0), "spacemouse": ("x", 1.0), "keyboard": ("w", 1.0)}
START = {"gamepad": "start", "keyboard": "enter"}
LEADER = LeaderCalibration(
    {ARM[0]: LeaderJoint("pan.pos", np.pi / 180), ARM[1]: LeaderJoint("lift.pos", -np.pi / 180)},
    LeaderGripper("handle.pos", closed=0.0, opened=100.0),
)


class Driven:
    """A person with devices that a test moves."""

    def __init__(self, device, mode="ee", beside="", follower=None, model=MODEL):
        self.clock, self.model = Clock(), model
        hands = len(model.description.hands)
        self.person = Person(model, fitting(MODES, hands), mode, self.clock)
        self.person.ask(Ask("frame", "base"))
        controls = (
            load_map(device, CONTROLS[device], hands=hands) if device in CONTROLS else ControlMap({}, {})
        )
        self.main, self.beside = PlayedReader(device, self.clock, controls), None
        if beside:
            table = load_map(beside, CONTROLS[beside]).only(*(["base"] if follower else []))
            self.beside = PlayedReader(beside, self.clock, table)
        self.local = LocalPerson(self.person, self.main, self.beside, follower)
        self.q, self.time = np.array(model.description.home), 0.0
        self.local.reset(self.view(), np.random.default_rng(0))

    def view(self):
        task = SimpleNamespace(goal=Pose(np.array([1.0, 0.0, 1.0]), np.eye(3)), tool=self.model.pose(self.q))
        return View(State(self.q, np.zeros(self.model.size), self.time), task)

    def act(self, seconds=0.05) -> Any:
        self.clock.now += seconds
        self.time += seconds
        return self.local.act(self.view())

    def begin(self):
        """Start, with everything let go and the dead-man held."""
        self.person.ask(Ask("start"))
        self.hold()
        assert isinstance(self.act(), Intent)

    def hold(self, down=True):
        if self.main.name == "gamepad":
            self.main.values["left_shoulder"] = float(down)

    def push(self, share=1.0):
        control, value = FORWARD[self.main.name]
        self.main.values[control] = share * value

    def shown(self):
        paper = io.StringIO()
        Console(width=110, file=paper).print(self.local)
        return paper.getvalue()
