"""What comes into a controller: intents, states, obstacles. It fails closed and brakes in time."""

from dataclasses import replace

import numpy as np
import pytest
from ideal_robot import HOME, LIMITS, MODEL, PERIOD, Robot, asking

from handrail.controllers.baselines.cbf_filter import CbfFilter
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.baselines.unprotected import split_controller, unprotected_controller
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.shape import Obstacle, Shape

CHANNELS = Channels.of(MODEL.description)
AHEAD = asking(np.eye(18)[0] * 0.3, "base")
JOINTS = asking(np.eye(18)[9] * 0.3, "joint")
CONTROLLERS = {
    "mpc": (MaskedMpc, AHEAD),
    "cbf": (CbfFilter, JOINTS),
    "direct": (DirectController, JOINTS),
    "split": (split_controller, AHEAD),
    "unprotected": (unprotected_controller, AHEAD),
}
STUCK, JUMPED = "stands still", "jumps back"
WALL = Obstacle("wall", Shape("box", [0.2, 4.0, 0.2]), [HOME[0] + 3.0, 0.0, 0.1])


@pytest.mark.parametrize("period", [0.0, -0.05, np.nan, np.inf, "1", None])
@pytest.mark.parametrize("build", [CbfFilter, DirectController])
def test_a_period_that_is_none_is_refused(build, period):
    with pytest.raises(HandrailError, match=r"^control period \[s\]: expected a number"):
        build(MODEL, period)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Intent(np.zeros(18), np.zeros(18, bool), frames="tool"),  # type: ignore[arg-type]
        lambda: Intent(np.zeros(18), np.zeros(18, bool), grippers=None),  # type: ignore[arg-type]
        lambda: Obstacle("wall", "box", np.zeros(3)),  # type: ignore[arg-type]
        lambda: Obstacle("wall", WALL.shape, np.array([1e200, 0.0, 0.0])),
        lambda: Shape("sphere", np.array([1e200])),
        lambda: Shape("cylinder", np.array([1e30, 1e30])),
    ],
)
def test_an_invalid_part_of_an_input_is_one_line(make):
    with pytest.raises(HandrailError, match=r"^[^\n]+expected [^\n]+, got [^\n]+$"):
        make()


def test_direct_brakes_where_a_hand_is_commanded():
    """It completes nothing: the robot would stand, and nobody be told."""
    asked = asking(np.eye(18)[3] * 0.1, "ee")(0.0)
    found = DirectController(MODEL).update(State(HOME, np.zeros(9), 0.0), asked)
    assert found.diagnostics.status is Status.INVALID_INTENT


def test_a_single_gripper_may_be_a_number():
    assert Intent(np.zeros(18), np.zeros(18, bool), 0.5).grippers == (0.5,)  # type: ignore[arg-type]


@pytest.fixture(params=CONTROLLERS)
def driven(request):
    """Return a robot that has been driven for half a second, and what drives it."""
    build, ask = CONTROLLERS[request.param]
    robot = Robot(build(MODEL))
    for _ in range(10):
        assert not robot.update(ask(robot.time)).diagnostics.status.brakes
    assert robot.v[0] > 0.25
    return robot, ask


UNKNOWN = dict.fromkeys(("q", "v", "commanded"), np.full(9, np.nan))
BAD_STATES = [
    *(UNKNOWN, UNKNOWN | {"time": np.nan}),
    *({"commanded": np.full(9, np.nan)}, {"commanded": np.zeros(4)}),
    *({"q": np.full(9, np.nan)}, {"q": HOME[:4], "v": np.zeros(4)}),
]
BAD_INTENTS = [
    *(
        {"values": np.full(18, np.nan)},
        {"values": np.full(18, np.inf)},
        {"grippers": (np.nan,)},
        {"time": np.nan},
    ),
    *({"values": np.zeros(5), "mask": np.zeros(5, bool)}, {"mask": np.zeros(17, bool)}),
    *({"frames": Frames("moon")}, {"frames": Frames(tool="base")}),
    *({"frames": Frames(point=[np.nan, 0, 0])}, {"frames": Frames(point=[0, 0])}),
]


def assert_braked(robot, trouble, expected, periods=6):
    """Let an input be wrong for 0.3 s: the robot brakes, gently, and says why."""
    fastest, statuses = np.abs(robot.v).max(), []
    for k in range(periods):
        before = robot.v
        statuses.append(robot.update(*trouble(k)).diagnostics.status)
        assert np.all(np.abs(robot.v - before) <= LIMITS.acceleration * PERIOD + 1e-9)
    assert statuses[-1] is expected
    assert np.abs(robot.v).max() < fastest


@pytest.mark.parametrize("ahead", [0.0, 0.04, 10.0, 1e18])
def test_a_dead_link_brakes_whatever_the_operators_clock_says(driven, ahead):
    robot, ask = driven
    last = ask(robot.time + ahead)
    assert_braked(robot, lambda k: (last,), Status.INVALID_INTENT if ahead > 1.0 else Status.STALE_INTENT, 7)


def test_an_observation_seen_before_is_not_new(driven):
    """A message that is repeated, or an older one that arrives late, makes nothing fresh."""
    robot, ask = driven
    robot.update(ask(robot.time))
    stamps = [robot.time - PERIOD, robot.time - 0.3 * PERIOD]
    assert_braked(robot, lambda k: (ask(stamps[k % 2]),), Status.STALE_INTENT, 7)


@pytest.mark.parametrize("clock", [STUCK, JUMPED, np.nan])
def test_a_state_clock_that_does_not_advance_is_a_fault(driven, clock):
    robot, ask = driven
    stuck = robot.time - PERIOD

    def trouble(k):
        time = {STUCK: stuck, JUMPED: stuck - k}.get(clock, clock)
        return ask(time if np.isfinite(time) else robot.time), replace(robot.state, time=time)

    assert_braked(robot, trouble, Status.INVALID_STATE)
    now = robot.time if clock is not JUMPED else stuck - 10.0
    for k in range(8):  # and from when it runs on, all is well again, for as long as new intents come
        time = now + k * PERIOD
        command = robot.update(ask(time), replace(robot.state, time=time))
    assert not command.diagnostics.status.brakes


def test_a_clock_that_keeps_jumping_back_does_not_keep_an_intent_fresh(driven):
    """Two periods on, one jump back, and so on, with a dead link."""
    robot, ask = driven
    last, start = ask(robot.time), robot.time
    for k in range(24):
        command = robot.update(last, replace(robot.state, time=start + 0.1 * ((k % 3) - 1)))
    assert command.diagnostics.status.brakes
    np.testing.assert_allclose(robot.v, 0.0, atol=1e-4)


def test_a_clock_that_leaps_makes_an_intent_old(driven):
    robot, ask = driven
    last = ask(robot.time)

    def trouble(k):
        return last, replace(robot.state, time=1e6 + robot.time, commanded=robot.v)

    assert_braked(robot, trouble, Status.STALE_INTENT)


def test_a_refused_intent_does_not_open_the_hand(driven):
    robot, ask = driven
    robot.update(replace(ask(robot.time), grippers=(1.0,)))
    for stamp in (robot.time + 10.0, robot.time - 10.0):
        assert robot.update(ask(stamp)).grippers == (1.0,)
    robot.controller.update_scene((WALL, WALL))
    assert robot.controller.update(robot.state, ask(robot.time)).grippers == (1.0,)
    robot.time += PERIOD
    assert robot.update(ask(robot.time)).grippers == (0.0,)


@pytest.mark.parametrize("change", BAD_STATES)
def test_a_state_that_makes_no_sense_brakes(driven, change):
    robot, ask = driven
    assert_braked(robot, lambda k: (ask(robot.time), replace(robot.state, **change)), Status.INVALID_STATE)


@pytest.mark.parametrize("change", BAD_INTENTS)
def test_an_intent_that_makes_no_sense_brakes(driven, change):
    robot, ask = driven
    assert_braked(robot, lambda k: (replace(ask(robot.time), **change),), Status.INVALID_INTENT)
    assert 0.0 <= robot.commands[-1].grippers[0] <= 1.0


def test_obstacles_come_and_go_and_nothing_is_forgotten(driven):
    robot, ask = driven
    for scene in ((WALL,), (), (WALL, replace(WALL, name="other")), (replace(WALL, name="other"),)):
        robot.put(*scene)
        before, command = robot.v, robot.update(ask(robot.time))
        assert not command.diagnostics.status.brakes
        np.testing.assert_allclose(command.velocity(0.0), before, atol=1e-12)
    assert robot.v[0] > 0.25


def test_a_scene_that_makes_no_sense_brakes(driven):
    robot, ask = driven
    bad = [(WALL, WALL), (replace(WALL, frame="nowhere"),), (replace(WALL, name="floor"),)]
    bad.append((replace(WALL, name="fingers"),))  # as a shape of the robot is called
    for scene in bad:
        robot.controller.update_scene(scene)
        before, command = robot.v, robot.controller.update(robot.state, ask(robot.time))
        assert command.diagnostics.status is Status.INVALID_SCENE
        assert np.abs(command.velocity(PERIOD)).max() < np.abs(before).max()
        robot.time += PERIOD
    assert not robot.update(ask(robot.time)).diagnostics.status.brakes


@pytest.mark.parametrize("driven", ["mpc"], indirect=True)
def test_a_wall_that_appears_is_kept_from(driven):
    robot, ask = driven
    for _ in range(10):
        robot.update(ask(robot.time))
    robot.put(replace(WALL, position=[robot.q[0] + 0.48 + 0.1 + 0.4, 0.0, 0.1]))
    for _ in range(60):
        robot.update(ask(robot.time))
    assert 0.08 < robot.smallest < 0.12
    robot.put()
    for _ in range(20):
        robot.update(ask(robot.time))
    assert robot.v[0] > 0.25


BAD_OBSTACLES = [
    {"position": [np.nan, 0.0, 0.0]},
    {"position": [0.0, np.inf, 0.0]},
    {"position": [0.0, 0.0]},
    {"position": ["a", "b", "c"]},
    {"velocity": [0.0, 0.0, -np.inf]},
    {"velocity": [1j, 0.0, 0.0]},
    {"rotation": np.full((3, 3), np.nan)},
    {"rotation": np.zeros((3, 3))},
    {"rotation": 1.1 * np.eye(3)},
    {"rotation": np.diag([1.0, 1.0, -1.0])},
    {"rotation": np.eye(2)},
]


@pytest.mark.parametrize("change", BAD_OBSTACLES)
def test_an_obstacle_that_is_none_is_refused(change):
    (name,) = change
    with pytest.raises(HandrailError, match=f"{name} of obstacle 'wall': expected"):
        replace(WALL, **change)


@pytest.mark.parametrize("size", [[np.nan], [np.inf], [0.0], [-1.0], [1.0, 2.0], ["1"], [10**400]])
def test_a_shape_without_a_size_is_refused(size):
    with pytest.raises(HandrailError, match="size of a sphere: expected"):
        Shape("sphere", size)


@pytest.mark.parametrize("mask", [["False"] * 18, [np.nan] * 18, [0.0] * 18, [1] * 18, [1j] * 18])
def test_a_mask_is_bool(mask):
    with pytest.raises(HandrailError, match="mask of an intent: expected True or False"):
        Intent(np.zeros(18), mask)


@pytest.mark.parametrize(
    "value", [1j, 10**400, 10**5000, "0.5", None, object()], ids=lambda v: type(v).__name__
)
def test_a_number_that_is_not_real_is_one_line(value):
    for make in (
        lambda: Intent([value] * 18, np.zeros(18, bool)),
        lambda: Intent(np.zeros(18), np.zeros(18, bool), grippers=(value,)),
        lambda: Intent(np.zeros(18), np.zeros(18, bool), time=value),
        lambda: State([value] * 9, np.zeros(9)),
        lambda: State(np.zeros(9), np.zeros(9), time=value),
    ):
        with pytest.raises(HandrailError, match="expected") as caught:
            make()
        assert len(str(caught.value)) < 150


def test_rows_of_unequal_length_are_refused():
    with pytest.raises(HandrailError, match="values of an intent: expected real numbers"):
        Intent([[1.0], [1.0, 2.0]], np.zeros(2, bool))
