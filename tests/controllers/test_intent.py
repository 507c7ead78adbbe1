"""Laws of intent: prediction, frames, over-determined commands."""

import numpy as np
import pytest
from ideal_robot import CHANNELS, HOME, MODEL, asking, intent, roll

from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.prediction import (
    Bounded,
    Extrapolated,
    Smoothed,
    after,
    constant,
)
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.ocp.settings import MpcSettings

MPC = MaskedMpc(MODEL)
TIMES = 0.1 * np.arange(1, 11)


@pytest.mark.parametrize("speed", [0.05, 0.5, 1.0, 50.0])
def test_bounded_holds_for_a_way_not_for_a_time(speed):
    """The hand goes as far as the bound at any speed, to within a stage; other channels hold."""
    times = 0.01 * np.arange(1, 2001)
    values = np.full(18, 0.2)
    values[3:9] = [speed, 0.0, 0.0, 0.0, 0.0, 0.0]
    predicted = Bounded(CHANNELS, distance=0.4, angle=1.0)(intent(values, "ee", "base"), times)
    way = 0.01 * predicted[:, 3].sum()
    assert abs(way - 0.4) <= 0.01 * speed + 1e-9
    assert predicted[0, 3] == speed
    np.testing.assert_array_equal(predicted[:, :3], 0.2)


def test_bounded_ends_with_the_first_of_way_and_turn():
    values = np.zeros(18)
    values[CHANNELS.hand_slice()] = [0.1, 0.0, 0.0, 0.0, 0.0, 1.0]
    predicted = Bounded(CHANNELS, distance=1.0, angle=0.55)(intent(values, "ee"), TIMES)
    np.testing.assert_array_equal(predicted[:5], np.tile(values, (5, 1)))
    np.testing.assert_array_equal(predicted[5:], 0.0)
    resting = intent(np.zeros(18), "ee")
    np.testing.assert_array_equal(Bounded(CHANNELS)(resting, TIMES), constant(resting, TIMES))


def test_extrapolated_follows_a_ramp_and_levels_off():
    predict = Extrapolated(window=0.3, fade=0.2)
    for time in np.arange(0.0, 0.5, 0.05):
        asked = intent(np.full(18, 2.0 * time), "ee", time=time)
        predict = after(predict, asked)
        predicted = predict(asked, TIMES)
    slope = (predicted[:, 3] - 2.0 * 0.45) / TIMES
    assert slope[0] == pytest.approx(2.0, rel=0.25)
    assert predicted[-1, 3] - 0.9 == pytest.approx(2.0 * 0.2, rel=0.02)
    np.testing.assert_array_equal(predicted[:, 0], 0.0)


def test_extrapolated_forgets_at_a_mode_switch():
    predict = Extrapolated()
    for time in (0.0, 0.1, 0.2):
        predict = after(predict, intent(np.full(18, time), "ee", time=time))
    asked = intent(np.full(18, 0.3), "base", time=0.3)
    np.testing.assert_allclose(after(predict, asked)(asked, TIMES), constant(asked, TIMES))


def test_smoothed_is_what_a_low_pass_will_do():
    """What is predicted for a held command is the level at that time, in steps of any length."""
    asked = np.linspace(-1.0, 1.0, 18)
    once, often = Smoothed(constant, 0.5), Smoothed(constant, 0.5)
    ahead = once(intent(asked, "ee", time=2.0), TIMES)
    np.testing.assert_allclose(ahead[:, 3:9], (1.0 - np.exp(-TIMES[:, None] / 0.5)) * asked[3:9])
    np.testing.assert_array_equal(ahead[:, 9:], 0.0)
    for time in 2.0 + np.concatenate([[0.0], TIMES]):
        often = after(often, intent(asked, "ee", time=time))
        level = often(intent(asked, "ee", time=time), np.zeros(1))[0]
    np.testing.assert_allclose(level, ahead[-1], atol=1e-12)


@pytest.mark.parametrize("time_constant", [0.3, np.linspace(0.2, 1.0, 18)])
def test_smoothed_leads_where_the_command_does(time_constant):
    """Bursts of 0.2 s: the level's integral is the command's in the end, however slow the channel."""
    predict, step = Smoothed(constant, time_constant), 0.01
    asked = [np.full(18, 0.5 * (k // 20 % 2 == 0) * (k < 200)) for k in range(1600)]
    levels = []
    for k, values in enumerate(asked):
        now = intent(values, "ee", time=k * step)
        predict = after(predict, now)
        levels.append(predict(now, np.zeros(1))[0])
    np.testing.assert_allclose(
        step * np.sum(levels, axis=0)[3:9], step * np.sum(asked, axis=0)[3:9], rtol=0.02
    )
    steepest = np.abs(np.diff(levels, axis=0)).max(axis=0)[3:9]
    assert np.all(steepest <= 0.5 * step / np.broadcast_to(time_constant, 18)[3:9] + 1e-9)


def test_smoothed_begins_at_rest_and_again_on_new_channels():
    predict = new = Smoothed(constant, 0.5)
    for time in (0.0, 1.0, 2.0):
        predict = after(predict, intent(np.ones(18), "ee", time=time))
    asked = intent(np.ones(18), "base", time=2.1)
    switched = after(predict, asked)(asked, np.zeros(1))[0]
    assert 0.0 <= switched[:3].max() < 0.2
    np.testing.assert_array_equal(switched[3:9], 0.0)
    np.testing.assert_array_equal(new(intent(np.ones(18), "ee", time=9.0), np.zeros(1)), 0.0)


def test_smoothed_begins_from_rest_after_a_silence():
    predict = Smoothed(constant, 0.5)
    for time in np.arange(0.0, 2.0, 0.1):
        predict = after(predict, intent(np.ones(18), "ee", time=time))
    levels = []
    for gap in (0.2, 5.0):  # shorter and longer than the dead-man time
        released = intent(np.zeros(18), "ee", time=1.9 + gap)
        levels.append(after(predict, released)(released, np.zeros(1))[0, 3:9])
    assert levels[0].min() > 0.8
    np.testing.assert_array_equal(levels[1], 0.0)


def test_turns_may_be_followed_less_closely_than_the_way():
    """A small weight of the tool's turning leaves the way alone and costs some of the turn."""
    asked, errors = {"ee.vx": 0.1, "ee.vz": 0.05, "ee.wy": 0.3}, []
    for weight in (1000.0, 0.5):
        controller = MaskedMpc(MODEL, MpcSettings(turn_tracking=weight))
        q, v, _ = roll(controller, [asking(asked, "ee")] * 30)
        errors.append(
            np.abs(MODEL.jacobian(q[-1]) @ v[-1] - intent(asked, "ee").values[CHANNELS.hand_slice()])
        )
    assert errors[0].max() < 0.01
    assert errors[1][:3].max() < 0.01
    assert errors[1][3:].max() > 0.02


def test_a_prediction_of_another_shape_is_refused_before_anything_moves():
    mpc = MaskedMpc(MODEL, predict=lambda now, times: np.zeros((1, 18)))
    with pytest.raises(HandrailError, match=r"expected values of shape \(\d+, 18\), got \(1, 18\)"):
        mpc.update(State(HOME, np.zeros(MODEL.size)), intent(np.zeros(18), "ee"))


def test_the_base_twist_is_meant_in_its_frame():
    turned = np.array(HOME)
    turned[2] = np.pi / 2
    for frame, expected in (("base", [0.0, 0.2]), ("world", [0.2, 0.0])):
        MPC.reset()
        _, v, _ = roll(MPC, [asking({"base.vx": 0.2}, "base", frames=Frames(base=frame))] * 30, q=turned)
        np.testing.assert_allclose(v[-1, :2], expected, atol=5e-3)


@pytest.mark.parametrize("owned", [("base.vx",), ("base.vx", "base.wz")])
def test_a_base_whose_way_ahead_alone_is_commanded_stops_sliding_sideways(owned):
    MPC.reset()
    drive, stand = asking({"base.vy": 0.3}, "base"), asking({}, *owned)
    _, v, _ = roll(MPC, [drive] * 20 + [stand] * 80)
    assert v[20, 1] > 0.25
    assert np.abs(v[-1]).max() < 0.02


def test_the_tool_twist_is_meant_in_its_frame_and_at_its_point():
    point = np.array([0.1, 0.0, 0.15])
    asked = asking({"ee.vz": 0.1, "ee.wx": 0.2}, "ee", frames=Frames(tool="tool", point=point))
    MPC.reset()
    positions, velocities, _ = roll(MPC, [asked] * 30)
    twist, rotation = MODEL.jacobian(positions[-1]) @ velocities[-1], MODEL.pose(positions[-1]).rotation
    at_point = twist[:3] + np.cross(twist[3:], rotation @ point)
    np.testing.assert_allclose(rotation.T @ at_point, [0.0, 0.0, 0.1], atol=5e-3)
    np.testing.assert_allclose(rotation.T @ twist[3:], [0.2, 0.0, 0.0], atol=5e-3)


def test_an_over_determined_command_is_a_compromise():
    """The hand forward, all joints at rest: no robot can do both; what it does is between the two."""
    MPC.reset()
    q, v, _ = roll(MPC, [asking({"ee.vx": 0.2}, "ee", "joint")] * 30)
    assert 0.02 < (MODEL.jacobian(q[-1]) @ v[-1])[0] < 0.19


@pytest.mark.parametrize(
    "change",
    [
        *({"horizon": 0}, {"horizon": 10**6}, {"dt": 0.0}, {"decay": 1.5}, {"margin": np.nan}),
        *({"activation_distance": -1.0}, {"slack_quadratic": 0.0}),
    ],
)
def test_wrong_settings_are_refused(change):
    with pytest.raises(HandrailError, match="MPC setting"):
        MpcSettings(**change)
