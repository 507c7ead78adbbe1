"""Every recorded column comes from its own source: whatever is swapped or altered on the way shows."""

import numpy as np
from collect_helpers import recording

from handrail.collect.session.session import Session
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.ideal_robot import IdealRobot
from handrail.collect.world.tasks.reach import Reach
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Command, Diagnostics, Status
from handrail.controllers.interface.intent import Intent, RawInput
from handrail.controllers.robot.model import load_model
from handrail.datasets.reading.reader import read_frames
from handrail.datasets.recording.frames import COLUMNS

MODEL, FPS, STEPS = load_model(), 20, 12
CHANNELS = Channels.of(MODEL.description)
STATUSES = tuple(Status)


class Counter:
    """An operator of whom every number is another one at every call."""

    def reset(self, view, rng):
        self.views, self.intents = [], []

    def act(self, view):
        k = len(self.intents)
        values = 0.01 * (np.arange(CHANNELS.size) + 1.0) + k
        raw = RawInput(-0.5 * values, 100 + k, 200 + 3 * k, f"device {k}", 0.2 + k, 0.3 + k)
        mask = (np.arange(CHANNELS.size) + k) % 3 == 0
        self.intents.append(Intent(values, mask, (0.01 * k,), f"mode {k}", view.state.time, raw=raw))
        self.views.append(view)
        return self.intents[-1]


class Answer:
    """A controller of which every number is another one at every update, faster than the robot may go."""

    def reset(self, obstacles=()):
        self.commands = []

    def update_scene(self, obstacles):
        pass

    def update(self, state, intent):
        k = len(self.commands)
        wanted = np.full(MODEL.size, 5.0 + k)
        diagnostics = Diagnostics(
            STATUSES[k % len(STATUSES)],
            solve_time=0.001 * (k + 1),
            slack=0.3 + k,
            smallest_distance=0.5 + 0.01 * k,
            work_distance=1.5 + 0.01 * k,
        )
        velocities = np.stack([state.commanded, wanted, 0.0 * wanted])
        self.commands.append(
            Command(velocities, 1.0 / FPS, grippers=(0.5 + 0.01 * k,), diagnostics=diagnostics)
        )
        return self.commands[-1]


class Counted(HandrailEnv):
    """Notes what every step returns, and says another number of contacts each time."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.infos = []

    def step(self, action):
        *seen, info = super().step(action)
        self.infos.append(info | {"contacts": 7 + 2 * len(self.infos)})
        return (*seen, self.infos[-1])


def test_every_column_is_what_its_source_said(tmp_path):
    """Observed before the step, asked by the operator, commanded, sent within limits, or of the world."""
    env = Counted(Reach(time_limit=STEPS / FPS, moving_obstacles=1), MODEL, fps=FPS, plant=IdealRobot)
    operator, controller = Counter(), Answer()
    with recording(tmp_path / "set", env) as recorder:
        outcome = Session(env, controller, operator, [recorder]).run(3)
        recorder.end(outcome)
    assert outcome.frames == STEPS
    views, intents, infos = operator.views, operator.intents, env.infos
    commanded = controller.commands
    sent = np.array([view.state.commanded for view in views[1:]])
    told = [command.diagnostics for command in commanded]
    expected = {
        "observation.state": [view.observation["agent_pos"] for view in views],
        "observation.environment_state": [env.task.features(view.task) for view in views],
        "action": [*(info["sent"] for info in infos)],
        "teleop.values": [np.append(np.where(i.mask, i.values, 0.0), i.grippers) for i in intents],
        "teleop.mask": [[*intent.mask, True] for intent in intents],
        "teleop.mode": [f"mode {k}" for k in range(STEPS)],
        "teleop.raw": [intent.raw.values for intent in intents],
        "teleop.axes": [100 + k for k in range(STEPS)],
        "teleop.switches": [200 + 3 * k for k in range(STEPS)],
        "teleop.device": [f"device {k}" for k in range(STEPS)],
        "teleop.age": [0.2 + k for k in range(STEPS)],
        "teleop.round_trip": [0.3 + k for k in range(STEPS)],
        "teleop.undos": [0] * STEPS,
        "controller.command": [np.append(command.velocities[1], command.grippers) for command in commanded],
        "controller.status": [one.status.value for one in told],
        "controller.solve_time": [one.solve_time for one in told],
        "controller.slack": [one.slack for one in told],
        "controller.smallest_distance": [one.smallest_distance for one in told],
        "controller.work_distance": [one.work_distance for one in told],
        "safety.contacts": [7 + 2 * k for k in range(STEPS)],
        "next.success": [info["is_success"] for info in infos],
        "next.done": [False] * (STEPS - 1) + [True],
    }
    frames = read_frames(tmp_path / "set", 0)
    for name, values in expected.items():
        got = np.array([*frames[name]])
        np.testing.assert_array_equal(got, np.asarray(values).astype(got.dtype), name)
    assert {*expected, "wall_clock"} == {column.name for column in COLUMNS}
    state, action = (np.array([*frames[name]]) for name in ("observation.state", "action"))
    np.testing.assert_array_equal(state[:, : MODEL.size], np.float32([view.state.q for view in views]))
    np.testing.assert_array_equal(action[:-1, :-1], np.float32(sent))
    assert np.all(np.abs(sent).max(axis=1) < [5.0 + k for k in range(STEPS - 1)])  # the robot's limits cut it
    assert frames["wall_clock"][0] >= 0.0
    assert np.all(np.diff(frames["wall_clock"]) > 0)
