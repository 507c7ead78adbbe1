"""Laws of the completions: rules that turn a twist of the tool into a whole-body velocity."""

import sys
from dataclasses import replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from ideal_robot import CHANNELS, HOME, LIMITS, MODEL, REST, asking, intent, roll

from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_controller, build_mode, build_modes
from handrail.collect.world.mink import MINK
from handrail.collect.world.tasks.goal_reaching import STEP
from handrail.controllers.baselines.arm_completion import (
    LARGEST_RATE,
    LARGEST_SPEED,
    ArmCompletion,
    BaseFollowingCompletion,
    WeldedBaseCompletion,
    clamp_twist,
)
from handrail.controllers.baselines.twist_completion import WholeBodyCompletion, tool_twist
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.build import built_in_objectives
from handrail.controllers.objectives.objective import Stage
from handrail.controllers.objectives.tracking import channel_velocities
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.registry import resolved
from handrail.controllers.robot.model import RobotModel, load_model
from handrail.controllers.robot.shape import Obstacle, Shape
from handrail.scripts.bench.goal_reaching.config import BASELINES

TWISTS = arrays(float, 6, elements=st.floats(-0.2, 0.2))
NEAR_HOME = arrays(float, 9, elements=st.floats(-0.3, 0.3)).map(lambda change: HOME + change)
ANY_TWIST = arrays(float, 6, elements=st.floats(-10, 10))
BASES = arrays(float, 3, elements=st.floats(-2.0, 2.0))
RIVALS = [name for name in BASELINES if name not in ("mpc", "mpc_one_stage", "safety_filter")]
QUICK = settings(max_examples=30, deadline=None)


def controller(name):
    if name == "mink":
        pytest.importorskip("mink")
    return BASELINES[name].controller(MODEL)


def of_the_tool(twist):
    return dict(zip(CHANNELS.names[CHANNELS.hand_slice()], twist, strict=True))


@given(NEAR_HOME, TWISTS, st.sampled_from(["world", "tool"]), arrays(float, 3, elements=st.floats(-0.3, 0.3)))
@QUICK
def test_a_twist_means_the_same_as_in_the_mpc(q, twist, frame, point):
    """A velocity with the twist at the robot's tool point tracks the intent's channels without error."""
    asked = intent(of_the_tool(twist), "ee", frames=Frames(tool=frame, point=point))
    meant = tool_twist(asked, CHANNELS, MODEL.pose(q))
    v = np.linalg.lstsq(MODEL.jacobian(q), meant, rcond=None)[0]
    z, p = ca.SX.sym("z", 27), ca.SX.sym("p", 5)
    stage = Stage(MODEL, z[:9], z[9:18], z[18:])
    channels = ca.Function("channels", [z, p], [channel_velocities(stage, CHANNELS, p)])
    found = np.array(channels(np.concatenate([q, v, REST]), asked.frames.parameters)).ravel()
    np.testing.assert_allclose(found[CHANNELS.hand_slice()], twist, atol=1e-6)


@given(NEAR_HOME, TWISTS, BASES)
@QUICK
def test_damped_least_squares_is_the_optimum(q, twist, base):
    """The gradient of ‖J v − e‖² + λ‖W v‖² is 0: of all joints; of the arm's, whatever the base does."""
    damping, jacobian = 0.01, MODEL.jacobian(q)
    whole = WholeBodyCompletion(MODEL)(q, REST, twist, STEP)
    arm = ArmCompletion(MODEL, damping).arm_velocity(q, base, twist)
    for v, joints in ((whole, slice(9)), (np.concatenate([base, arm]), slice(3, 9))):
        gradient = jacobian.T @ (jacobian @ v - twist) + damping * v / LIMITS.velocity**2
        np.testing.assert_allclose(gradient[joints], 0.0, atol=1e-9)


@given(arrays(float, 9, elements=st.floats(-1.0, 1.0)), BASES, ANY_TWIST)
def test_the_arm_s_limits_hold_for_anything(previous, base, twist):
    previous = previous * LIMITS.velocity
    v = ArmCompletion(MODEL).velocity(HOME, previous, base, twist, STEP)
    assert np.all(np.abs(v) <= LIMITS.velocity + 1e-9)
    assert np.all(np.abs(v - previous) <= LIMITS.acceleration * STEP + 1e-9)


@given(BASES)
def test_the_arm_makes_up_for_the_base_that_the_limits_leave(base):
    """Law: the arm answers to what the base will do, not to what was asked of it."""
    arm, step = ArmCompletion(MODEL), LIMITS.acceleration * STEP
    v = arm.velocity(HOME, REST, base, np.zeros(6), STEP)
    np.testing.assert_allclose(v[:3], np.clip(base, -step[:3], step[:3]))
    expected = np.clip(arm.arm_velocity(HOME, v[:3], np.zeros(6)), -step[3:], step[3:])
    np.testing.assert_allclose(v[3:], expected, atol=1e-12)


@given(arrays(float, 3, elements=st.floats(-0.1, 0.1)), st.floats(-3.0, 3.0))
def test_a_welded_base_makes_planar_motions_alone(planar, angle):
    """Law: for vx, vy, ωz of the tool the arm rests, wherever the base points."""
    q = HOME.copy()
    q[2] = angle
    twist = np.array([planar[0], planar[1], 0.0, 0.0, 0.0, planar[2]])
    v = WeldedBaseCompletion(MODEL)(q, REST, twist, duration=10.0)
    np.testing.assert_allclose(v[3:], 0.0, atol=1e-9)
    np.testing.assert_allclose(MODEL.jacobian(q) @ v, twist, atol=1e-9)


@given(ANY_TWIST)
def test_a_long_twist_is_shortened_and_keeps_its_direction(twist):
    clamped = clamp_twist(twist)
    for part, most in ((slice(0, 3), LARGEST_SPEED), (slice(3, 6), LARGEST_RATE)):
        length = np.linalg.norm(twist[part])
        assert np.linalg.norm(clamped[part]) == pytest.approx(min(length, most))
        assert np.allclose(clamped[part] * length, twist[part] * np.linalg.norm(clamped[part]))


def test_a_base_that_follows_rests_when_nothing_is_asked():
    q, rule = HOME.copy(), BaseFollowingCompletion(MODEL)
    q[3] += 0.8  # the hand is out of its place
    assert np.linalg.norm(rule.base_velocity(q)) > 0.05
    np.testing.assert_allclose(rule(q, REST, np.zeros(6), STEP), 0.0, atol=1e-9)


@pytest.mark.parametrize("name", ["dls", "dls_arm", "dls_base", "blended", "mink", "mpc_one_stage"])
def test_a_rival_follows_the_hand(name):
    """From home, after the acceleration, a slow twist is followed to a few per cent."""
    twist = np.array([0.05, 0.03, 0.02, 0.05, -0.05, 0.1])
    q, v, _ = roll(controller(name), [asking(of_the_tool(twist), "ee")] * 30, period=STEP)
    np.testing.assert_allclose(MODEL.jacobian(q[-1]) @ v[-1], twist, atol=0.05 * float(np.linalg.norm(twist)))


@pytest.mark.parametrize("name", RIVALS)
@given(twists=st.lists(ANY_TWIST, min_size=4, max_size=4))
@settings(max_examples=10, deadline=None)
def test_a_rival_stays_inside_the_limits(name, twists):
    """Whatever is asked, velocity and acceleration stay inside, and a garbled message brakes."""
    rival, v, q = controller(name), REST, HOME.copy()
    operator = resolved(BASELINES[name].operator)(MODEL)
    for step, twist in enumerate(twists):
        state = State(q, v, step * STEP)
        after = rival.update(state, operator(twist, state, state.time)).velocity(STEP)
        assert np.all(np.abs(after) <= LIMITS.velocity + 1e-9)
        assert np.all(np.abs(after - v) <= LIMITS.acceleration * STEP + 1e-9)
        q, v = q + 0.5 * STEP * (v + after), after
    state = State(q, v, 4 * STEP)
    command = rival.update(state, replace(operator(np.full(6, 0.1), state, state.time), time=np.nan))
    assert command.diagnostics.status is Status.INVALID_INTENT
    assert np.all(np.abs(command.velocity(STEP)) <= np.abs(v) + 1e-9)


@pytest.mark.parametrize("name", RIVALS)
def test_a_rival_says_how_it_fares(name):
    state = State(HOME, REST, 1.0)
    stale = resolved(BASELINES[name].operator)(MODEL)(np.full(6, 0.1), state, 0.5)
    command = controller(name).update(state, stale)
    assert command.diagnostics.status is Status.STALE_INTENT
    assert command.diagnostics.solve_time > 0
    assert 0.05 < command.diagnostics.smallest_distance < 0.2
    np.testing.assert_array_equal(command.velocity(STEP), 0.0)


@pytest.mark.parametrize("name", ["dls", "decoupled", "mink"])
@pytest.mark.parametrize(
    ("groups", "status"), [(("ee", "base"), Status.INVALID_INTENT), ((), Status.OK)], ids=["others", "none"]
)
def test_controllers_of_twists_refuse_other_channels_and_rest_without_any(name, groups, status):
    command = controller(name).update(State(HOME, REST), intent(np.full(CHANNELS.size, 0.1), *groups))
    assert command.diagnostics.status is status
    np.testing.assert_array_equal(command.velocities, 0.0)


def test_an_arm_without_a_base_completes_too():
    of_the_arm = replace(LIMITS, **{name: getattr(LIMITS, name)[3:] for name in vars(LIMITS)})
    base = replace(MODEL.description.base, kind="fixed")
    arm = RobotModel(replace(MODEL.description, base=base, home=HOME[3:], limits=of_the_arm))
    twist = np.array([0.02, 0.01, 0.02, 0.0, 0.0, 0.0])
    for complete in (WholeBodyCompletion(arm, np.full(6, 1e-4)), BaseFollowingCompletion(arm)):
        v = complete(HOME[3:], np.zeros(6), twist, STEP)
        assert v.shape == (6,)
        assert (arm.jacobian(HOME[3:]) @ v) @ twist > 0


BAR = Obstacle("bar", Shape("box", [0.05, 0.05, 0.4]), [0.0, 0.0, 0.2], frame="tool")
WALL = Obstacle("wall", Shape("box", [0.1, 2.0, 2.0]), MODEL.pose(HOME).position + [1.0, 0.0, 0.0])


def into_the_mount(q):
    return MODEL.pose(q, "shoulder_link").position - MODEL.pose(q).position


@pytest.mark.parametrize(
    ("obstacles", "way"), [((), into_the_mount), ((BAR, WALL), lambda q: np.array([1.0, 0.0, 0.0]))]
)
def test_mink_keeps_its_distance(obstacles, way):
    """Drive the hand into the robot's mount, or what it holds at a wall: plain least squares gets close."""
    pytest.importorskip("mink")
    smallest = {}
    for rival in (controller("dls"), controller("mink"), resolved(MINK.build)(MODEL, STEP)):
        name, q, v = rival, HOME.copy(), REST
        rival.reset(tuple(each for each in obstacles if not each.held))
        for step in range(500):
            rival.update_scene(obstacles)  # what is held was grasped after the beginning
            twist = np.append(0.15 * way(q) / np.linalg.norm(way(q)), np.zeros(3))
            command = rival.update(
                State(q, v, step * STEP), intent(of_the_tool(twist), "ee", time=step * STEP)
            )
            after = command.velocity(STEP)
            q, v = q + 0.5 * STEP * (v + after), after
            smallest[name] = min(smallest.get(name, np.inf), command.diagnostics.smallest_distance)
    plain, *kept = smallest.values()
    assert plain < 0.02
    assert min(kept) > 0.04


def test_the_base_goes_first_by_the_mpc_s_weights():
    """Of a way along the floor the base does nearly all, where plain least squares moves the arm."""
    twist, shares = np.array([0.1, 0.05, 0.0, 0.0, 0.0, 0.0]), {}
    for name in ("dls", "dls_base"):
        _, v, _ = roll(controller(name), [asking(of_the_tool(twist), "ee")] * 30, period=STEP)
        shares[name] = v[-1][:2] @ twist[:2] / (twist @ twist)
    assert shares["dls_base"] > 0.85
    assert shares["dls"] < 0.7


@pytest.mark.parametrize("robot", ["ridgeback_ur10", "lekiwi"])
def test_the_mpc_s_weights_are_those_of_the_robot_s_size(robot):
    model = load_model(robot)
    channels, weights = Channels.of(model.description), MpcSettings.of(model.description.world.scale)
    tracking, velocity, *_ = built_in_objectives(model, channels, weights)
    mask, values = channels.mask("ee"), np.zeros(channels.size)
    values[3] = 0.002
    asks = [lambda time: Intent(values, mask, time=time)] * 10
    q, v, _ = roll(build_controller(MODES["ee_dls_base"], model, 20.0), asks, model.description.home)
    weighed = model.jacobian(q[-1]).T * tracking.weights(mask)[channels.hand_slice()]
    hessian = weighed @ model.jacobian(q[-1]) + np.diag(velocity.weights(mask))
    expected = np.linalg.solve(hessian, weighed @ values[channels.hand_slice()])
    np.testing.assert_allclose(v[-1], expected, atol=1e-5)


def test_where_mink_is_missing_a_line_says_so_and_people_are_not_offered_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "mink", None)
    with pytest.raises(HandrailError, match=r"^differential IK: expected mink, found none; .*profile"):
        build_controller(MODES["ee_mink"], MODEL, 20.0)
    with pytest.raises(HandrailError, match=r"^mode ee_mink: expected mink, found none; .*'\.\[profile\]'$"):
        build_mode(SessionConfig(mode="ee_mink"), MODEL)
    env = SimpleNamespace(model=MODEL)
    offered = build_modes(SessionConfig(task="reach"), env)  # type: ignore[arg-type]
    assert "ee_mink" not in offered
    assert "ee_dls_base" in offered
