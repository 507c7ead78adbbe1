"""Laws: an undo goes back to where the robot went on last, as if nothing had been since; the data say so."""

import io
import math
import tempfile
import weakref
from dataclasses import replace

import av
import numpy as np
import pytest
from collect_helpers import recording

from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.session.build import build_controller, build_env
from handrail.collect.session.loop import EpisodeLoop
from handrail.collect.session.session import Session
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.ideal_robot import IdealRobot
from handrail.collect.world.simulation import Simulation
from handrail.collect.world.tasks.reach import Reach
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.model import load_model
from handrail.datasets.reading.reader import read_frames
from handrail.datasets.recording.writer import EpisodeWriter

FPS, MODEL = 20, load_model()
PAUSE, UNDO, SUCCESS = EpisodeEvent.PAUSE, EpisodeEvent.UNDO, EpisodeEvent.SUCCESS


class Person:
    """Steers the hand by a plan: pairs of what, an event or a direction, and for how many calls."""

    def __init__(self, plan):
        self._plan = [what for what, count in plan for _ in range(count)]
        self._channels = Channels.of(MODEL.description)

    def reset(self, view, rng):
        self._left = iter(self._plan)

    def act(self, view):
        what = next(self._left)
        if isinstance(what, EpisodeEvent):
            return what
        values = np.zeros(self._channels.size)
        values[self._channels.hand_slice()][:3] = what
        return Intent(values, self._channels.mask("ee"), mode="ee", time=view.state.time)


class PictureWatcher:
    """Counts the pictures of a camera that somebody still holds, moment by moment."""

    def __init__(self):
        self.pictures, self.in_memory = [], []

    def begin(self, env, seed):
        pass

    def see(self, frame):
        self.pictures.append(weakref.ref(frame.images["front"]))
        self.in_memory.append(sum(picture() is not None for picture in self.pictures))


FORTH, LEFT, RIGHT = (0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, -0.2, 0.0)
UNDONE = [(FORTH, 10), (PAUSE, 30), (LEFT, 12), (UNDO, 1), (RIGHT, 8), (SUCCESS, 1)]
PLAIN = [(FORTH, 10), (PAUSE, 30), (RIGHT, 8), (SUCCESS, 1)]


def recorded(root, plan, plant, robot_fps=FPS, watchers=(), **options):
    """Return the frames of an episode, and how it went."""
    env = HandrailEnv(Reach(moving_obstacles=1), MODEL, fps=robot_fps, plant=plant, **options)
    with recording(root, env) as recorder:
        periods = {"control_period": 1 / FPS, "record_period": 1 / FPS}
        outcome = Session(
            env, MaskedMpc(MODEL), Person(plan), [recorder, *watchers], undoes=True, **periods
        ).run(3)
        recorder.end(outcome)
    return read_frames(root, 0), outcome


@pytest.mark.parametrize("plant", [Simulation, IdealRobot])
@pytest.mark.parametrize("robot_fps", [FPS, 3 * FPS])
@pytest.mark.parametrize("pause", [0, 1, 30])
def test_undone_frames_are_not_recorded(tmp_path, plant, robot_fps, pause):
    """An undo in a pause takes back what came before the pause, whether the robot rests already or brakes."""
    undone = [*UNDONE[:3], (PAUSE, pause), *UNDONE[3:]]
    frames, outcome = recorded(tmp_path / "undone", undone, plant, robot_fps)
    plain, _ = recorded(tmp_path / "plain", PLAIN, plant, robot_fps)
    assert outcome.undos == 1
    assert len(frames["action"]) == len(plain["action"])
    for column in ("action", "observation.state", "teleop.values", "next.done"):
        got, wanted = (np.array(table[column].tolist()) for table in (frames, plain))
        assert np.allclose(got, wanted, rtol=0, atol=1e-6), column
    assert set(frames["teleop.undos"]) == {0, 1}
    assert sorted(frames["teleop.undos"]) == list(frames["teleop.undos"])


@pytest.mark.needs_gl
def test_pictures_are_those_of_what_was_not_undone_and_wait_outside_of_memory(tmp_path):
    watcher = PictureWatcher()
    options = {"cameras": ("front", "wrist"), "image_size": (48, 64), "watchers": [watcher]}
    left = [(LEFT if what == RIGHT else what, count) for what, count in PLAIN]
    for name, plan in (("undone", UNDONE), ("plain", PLAIN), ("left", left)):
        recorded(tmp_path / name, plan, Simulation, **options)
    assert len(watcher.pictures) > 50
    assert max(watcher.in_memory) <= 3  # of now and of the robot's last look
    for camera in ("front", "wrist"):
        undone, plain, other = (pictures(tmp_path / name, camera) for name in ("undone", "plain", "left"))
        assert undone.shape == plain.shape
        assert np.abs(undone - plain).sum() < 0.1 * np.abs(other - plain).sum()


def test_pictures_that_are_cut_short_are_said_in_a_line(tmp_path, monkeypatch):
    class Short(io.BytesIO):
        def read(self, size=-1):
            return super().read(size)[:-1]

    class Watcher(list):
        def begin(self, env, seed):
            pass

        see = list.append

    env, frames = HandrailEnv(Reach(), MODEL, fps=FPS, plant=IdealRobot), Watcher()
    Session(env, MaskedMpc(MODEL), Person([(FORTH, 1), (SUCCESS, 1)]), [frames]).run(3)
    monkeypatch.setattr(tempfile, "TemporaryFile", lambda **_: Short())
    with recording(tmp_path / "d", env) as recorder:
        seen = replace(frames[0], images={"front": np.zeros((4, 4, 3), np.uint8)})
        recorder.see(replace(seen, number=0, safe=0))
        with pytest.raises(
            HandrailError, match=r"^cannot read the pictures .* frame 0: expected 48 bytes, got 47"
        ):
            recorder.see(replace(seen, number=1, safe=1))


def pictures(root, camera):
    (path,) = root.glob(f"videos/observation.images.{camera}/**/*.mp4")
    with av.open(str(path)) as container:
        return np.array([frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)], float)


def test_the_commands_replay_to_the_same_states(tmp_path):
    frames, _ = recorded(tmp_path / "undone", UNDONE, Simulation)
    env = HandrailEnv(Reach(moving_obstacles=1), MODEL, fps=FPS)
    seen, _ = env.reset(seed=3)
    for state, action in zip(frames["observation.state"], frames["action"], strict=True):
        assert np.array_equal(np.asarray(state, np.float32), seen["agent_pos"])
        seen, *_ = env.step(np.asarray(action))


def test_without_a_pause_an_undo_goes_to_the_beginning_and_one_of_nothing_is_none(tmp_path):
    frames, outcome = recorded(tmp_path / "d", [(FORTH, 6), (UNDO, 1), (RIGHT, 4), (SUCCESS, 1)], IdealRobot)
    assert outcome.frames == len(frames["action"]) == 5
    assert set(frames["teleop.undos"]) == {1}
    _, outcome = recorded(tmp_path / "e", [(UNDO, 3), (RIGHT, 4), (SUCCESS, 1)], IdealRobot)
    assert outcome.undos == 0


@pytest.mark.parametrize("mode", ["ee", "direct", "ee_mink"])
def test_a_hand_keeps_what_it_holds_though_nobody_has_been_heard(mode):
    """Law: an invalid intent moves no gripper, be it the first of an episode or the first after an undo."""
    env = build_env(SessionConfig(task="tray", mode=mode), 20)
    loop = EpisodeLoop(env, build_controller(MODES[mode], env.model, 20))
    size = Channels.of(env.model.description).size
    loop.begin(0)
    nonsense = Intent(np.full(size, np.nan), np.ones(size, dtype=bool), time=0.0)
    begin = loop.checkpoint()
    for _ in range(2):
        frames = [loop.step(nonsense) for _ in range(10)]
        assert {float(frame.action[-1]) for frame in frames} == {1.0}
        assert all(np.isfinite(frame.command).all() and frame.diagnostics.status.brakes for frame in frames)
        assert not loop.now.info["failure_reason"]
        loop.restore(begin)
        assert loop.now.info["sent"].tolist() == [0.0] * env.model.size + [1.0]
    env.close()


@pytest.mark.parametrize("grippers", [(math.nan, 0.0), (0.0, math.nan)])
def test_grippers_that_no_robot_has_brake(grippers):
    """Law: a controller's grippers that are NaN in part end no episode: the robot brakes."""
    env = build_env(SessionConfig(task="tray", mode="direct", robot="tiago_pro"), 20)
    controller = build_controller(MODES["direct"], env.model, 20)
    loop, ask = EpisodeLoop(env, controller), controller.update
    controller.update = lambda state, intent: replace(ask(state, intent), grippers=grippers)
    loop.begin(0)
    before = loop.now.info["sent"][env.model.size :].tolist()
    channels = Channels.of(env.model.description)
    values = np.where(channels.mask("joint"), 0.3, 0.0)
    frame = loop.step(Intent(values, channels.mask("joint"), time=loop.now.view.state.time))
    assert frame.action.tolist() == [0.0] * env.model.size + before
    env.close()


class Beat:
    """Notes how many frames were written in each period."""

    def __init__(self):
        self.written = [0]

    def begin(self, env, seed):
        pass

    def see(self, frame):
        self.written.append(0)


def test_to_go_on_after_a_pause_writes_little_at_once(tmp_path, monkeypatch):
    """The loop waits for it, with pictures for a second."""
    beat, add = Beat(), EpisodeWriter.add_frame

    def counted(self, *words):
        beat.written[-1] += 1
        add(self, *words)

    monkeypatch.setattr(EpisodeWriter, "add_frame", counted)
    plan = [(FORTH, 40), (PAUSE, 30), (LEFT, 30), (SUCCESS, 1)]
    frames, outcome = recorded(tmp_path / "d", plan, IdealRobot, watchers=[beat])
    assert sum(beat.written) == len(frames["action"]) == outcome.frames
    assert 1 < max(beat.written[:-1]) <= 4
