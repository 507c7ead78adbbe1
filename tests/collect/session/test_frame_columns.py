"""Every recorded column comes from its own source: whatever is swapped or altered on the way shows."""

from dataclasses import replace

import numpy as np
import pytest

from handrail.collect.session.build import session_features
from handrail.collect.session.recorder import Recorder
from handrail.collect.session.session import Session
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.ideal_robot import IdealRobot
from handrail.collect.world.tasks.reach import Reach
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Command, Diagnostics, Status
from handrail.controllers.interface.intent import Intent, RawInput
from handrail.controllers.robot.model import load_model
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.reading.reader import read_frames
from handrail.datasets.recording.frames import Frame, frame_row
from handrail.datasets.recording.writer import EpisodeWriter

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
        raw = RawInput(-0.5 * values, axes=100 + k, switches=200 + 3 * k)
        mask = (np.arange(CHANNELS.size) + k) % 3 == 0
        self.intents.append(Intent(values, mask, 0.01 * k, f"mode {k}", view.state.time, raw=raw))
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
        self.commands.append(Command(velocities, 1.0 / FPS, gripper=0.5 + 0.01 * k, diagnostics=diagnostics))
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


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """An episode of all these, and what a dataset says of it."""
    root = tmp_path_factory.mktemp("columns") / "set"
    env = Counted(Reach(horizon=STEPS / FPS, moving_obstacles=1), MODEL, fps=FPS, plant=IdealRobot)
    operator, controller = Counter(), Answer()
    manifest = Manifest("x/columns", FPS, "ridgeback_ur10", session_features(env), {})
    with EpisodeWriter.create(root, manifest) as writer:
        recorder = Recorder("count", {})
        recorder.writer = writer
        outcome = Session(env, controller, operator, [recorder]).run(3)
        recorder.end(outcome)
    assert outcome.frames == STEPS
    return env, operator, controller, read_frames(root, 0)


def test_observations_are_what_was_there_before_the_step(recorded):
    env, operator, _, frames = recorded
    for row, view in enumerate(operator.views):
        state = frames["observation.state"][row]
        np.testing.assert_array_equal(state[: MODEL.size], view.state.q.astype(np.float32))
        np.testing.assert_array_equal(state[MODEL.size : 2 * MODEL.size], view.state.v.astype(np.float32))
        assert state[2 * MODEL.size] == np.float32(view.task.opening)
        np.testing.assert_array_equal(state[-7:-4], view.tool.position.astype(np.float32))
        features = env.task.features(view.task).astype(np.float32)
        np.testing.assert_array_equal(frames["observation.environment_state"][row], features)


def test_what_was_asked_is_the_operators(recorded):
    _, operator, _, frames = recorded
    for row, intent in enumerate(operator.intents):
        asked = np.append(np.where(intent.mask, intent.values, 0.0), intent.gripper)
        np.testing.assert_array_equal(frames["teleop.values"][row], asked.astype(np.float32))
        np.testing.assert_array_equal(frames["teleop.mask"][row], [*intent.mask, True])
        np.testing.assert_array_equal(frames["teleop.raw"][row], intent.raw.values.astype(np.float32))
    assert frames["teleop.mode"].tolist() == [f"mode {k}" for k in range(STEPS)]
    assert frames["teleop.axes"].tolist() == [100 + k for k in range(STEPS)]
    assert frames["teleop.switches"].tolist() == [200 + 3 * k for k in range(STEPS)]


def test_what_was_commanded_and_how_it_fared_is_the_controllers(recorded):
    _, _, controller, frames = recorded
    for row, command in enumerate(controller.commands):
        wanted = np.append(command.velocities[1], command.gripper).astype(np.float32)
        np.testing.assert_array_equal(frames["controller.command"][row], wanted)
    told = [command.diagnostics for command in controller.commands]
    assert frames["controller.status"].tolist() == [one.status.value for one in told]
    for name in ("solve_time", "slack", "smallest_distance", "work_distance"):
        expected = np.array([getattr(one, name) for one in told], dtype=np.float32)
        np.testing.assert_array_equal(frames[f"controller.{name}"], expected, name)


def test_what_was_sent_is_what_the_robot_was_sent(recorded):
    """Not what the controller wanted: the robot's limits cut that."""
    env, operator, controller, frames = recorded
    following = [view.state.commanded for view in operator.views[1:]]
    for row, sent in enumerate(following):
        np.testing.assert_array_equal(frames["action"][row][:-1], sent.astype(np.float32))
        assert np.abs(frames["action"][row][:-1]).max() < np.abs(frames["controller.command"][row]).max()
    np.testing.assert_array_equal(frames["action"][-1], env.infos[-1]["sent"])
    assert frames["action"][:, -1] == pytest.approx([command.gripper for command in controller.commands])


def test_what_happened_is_the_worlds(recorded):
    env, _, _, frames = recorded
    assert frames["safety.contacts"].tolist() == [7 + 2 * k for k in range(STEPS)]
    assert frames["next.success"].tolist() == [info["is_success"] for info in env.infos]
    assert frames["next.done"].tolist() == [False] * (STEPS - 1) + [True]
    clock = frames["wall_clock"]
    assert clock[0] >= 0.0
    assert np.all(np.diff(clock) > 0)


RAW = RawInput([0.8, 0.9], 10, 11, "pad", 0.21, 0.22)
FRAME = Frame(
    state=np.array([1.0, 2.0]),
    environment=np.array([3.0]),
    images={"wrist": np.zeros((2, 2, 3), np.uint8)},
    intent=Intent(np.array([4.0, 5.0]), np.array([True, True]), 0.6, "ee", 0.7, raw=RAW),
    action=np.array([12.0, 0.0]),
    command=np.array([13.0, 1.0]),
    diagnostics=Diagnostics(Status.CLIPPED, 0.14, 0.15, 0.16, 0.17),
    contacts=18,
    success=False,
    done=False,
    wall_clock=19.0,
    number=0,
    safe=1,
    undos=23,
)
INTENT, SAID = FRAME.intent, FRAME.diagnostics
MUTATIONS = {
    "observation.state": {"state": np.array([1.0, 2.5])},
    "observation.environment_state": {"environment": np.array([3.5])},
    "observation.images.wrist": {"images": {"wrist": np.ones((2, 2, 3), np.uint8)}},
    "action": {"action": np.array([12.5, 0.0])},
    "teleop.values": {"intent": replace(INTENT, gripper=0.65)},
    "teleop.mode": {"intent": replace(INTENT, mode="base")},
    "teleop.raw": {"intent": replace(INTENT, raw=replace(INTENT.raw, values=np.array([0.8, 0.95])))},
    "teleop.axes": {"intent": replace(INTENT, raw=replace(INTENT.raw, axes=20))},
    "teleop.switches": {"intent": replace(INTENT, raw=replace(INTENT.raw, switches=21))},
    "teleop.device": {"intent": replace(INTENT, raw=replace(INTENT.raw, device="keys"))},
    "teleop.age": {"intent": replace(INTENT, raw=replace(INTENT.raw, age=0.23))},
    "teleop.round_trip": {"intent": replace(INTENT, raw=replace(INTENT.raw, round_trip=0.24))},
    "teleop.undos": {"undos": 25},
    "controller.command": {"command": np.array([13.5, 1.0])},
    "controller.status": {"diagnostics": replace(SAID, status=Status.OK)},
    "controller.solve_time": {"diagnostics": replace(SAID, solve_time=0.145)},
    "controller.slack": {"diagnostics": replace(SAID, slack=0.155)},
    "controller.smallest_distance": {"diagnostics": replace(SAID, smallest_distance=0.165)},
    "controller.work_distance": {"diagnostics": replace(SAID, work_distance=0.175)},
    "safety.contacts": {"contacts": 22},
    "next.success": {"success": True},
    "next.done": {"done": True},
    "wall_clock": {"wall_clock": 23.0},
}


def changed(frame: Frame) -> set[str]:
    """Return the columns in which a frame differs from the one above."""
    before, after = frame_row(FRAME), frame_row(frame)
    return {name for name in before if not np.array_equal(before[name], after[name])}


@pytest.mark.parametrize("name", MUTATIONS)
def test_each_source_changes_its_own_column_and_no_other(name):
    assert changed(replace(FRAME, **MUTATIONS[name])) == {name}


def test_every_column_has_a_source():
    """A mask changes what is asked too: what nobody owns is zero."""
    masked = replace(FRAME, intent=replace(INTENT, mask=np.array([True, False])))
    assert changed(masked) == {"teleop.mask", "teleop.values"}
    assert {*MUTATIONS, "teleop.mask"} == set(frame_row(FRAME))
