"""The autonomous objectives' laws: derivatives, effect, and that they never overwrite a command."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from ideal_robot import CHANNELS, HOME, MODEL, PERIOD, intent, realised, roll

from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.objectives.hold import end_effector_hold, hold_parameters
from handrail.controllers.objectives.objective import Stage, switchable, switched
from handrail.controllers.objectives.ownership import leaves_freedom
from handrail.controllers.objectives.tray import GRAVITY, acceleration, tray_levelling
from handrail.controllers.ocp.settings import MpcSettings

HAND = MODEL.pose(HOME)
UP = HAND.rotation.T @ np.array([0.0, 0.0, 1.0])
PLACES = {"hold": hold_parameters(HAND)}


def everything():
    return end_effector_hold(CHANNELS, orientation=1.0), tray_levelling(CHANNELS, UP)


NAMES = [objective.name for objective in everything()]


def scaled(objective, factor):
    return replace(objective, weights=lambda mask: factor * objective.weights(mask))


def steer(objectives, groups, ask, steps=80, settings=None):
    """Steer an ideal robot by `ask(time)`, {channel: value}; return positions and velocities."""
    mpc = MaskedMpc(MODEL, settings, tuple(objectives))
    mpc.reset()
    for objective in objectives:
        if objective.name in PLACES:
            mpc.set_parameters(objective.name, PLACES[objective.name])
    positions, velocities, commands = roll(mpc, [lambda t: intent(ask(t), *groups, time=t)] * steps)
    assert not any(command.diagnostics.status.brakes for command in commands)
    return positions, velocities


def function(objective):
    q, v, u = (ca.SX.sym(name, 9) for name in "qvu")
    p = ca.SX.sym("p", len(objective.parameters))
    z = ca.vertcat(q, v, u)
    residual = objective.residual(Stage(MODEL, q, v, u), p)
    outputs = [residual, ca.densify(ca.jacobian(residual, z))]
    return ca.Function("residual", [z, p], outputs)


@pytest.mark.parametrize("objective", everything(), ids=NAMES)
def test_the_jacobian_is_the_derivative(objective):
    evaluate, rng, h = function(objective), np.random.default_rng(3), 1e-6
    for _ in range(5):
        z = np.concatenate([HOME, np.zeros(18)]) + rng.uniform(-0.8, 0.8, 27)
        p = objective.parameters + rng.uniform(-0.3, 0.3, len(objective.parameters))
        if objective.name == "hold":
            p = hold_parameters(MODEL.pose(HOME + rng.uniform(-0.5, 0.5, 9)))
        value, jacobian = (np.array(part) for part in evaluate(z, p))
        assert value.shape == (len(objective.reference), 1)
        numeric = np.array(
            [
                (np.array(evaluate(z + s, p)[0]) - np.array(evaluate(z - s, p)[0])) / (2 * h)
                for s in h * np.eye(27)
            ]
        )[:, :, 0].T
        np.testing.assert_allclose(jacobian, numeric, atol=2e-5 * (1 + np.abs(numeric).max()))
        assert np.abs(numeric).max() > 1e-3


@pytest.mark.parametrize("objective", everything(), ids=NAMES)
def test_residuals_are_finite_where_they_are_kinked(objective):
    """At rest, on target, with the arm stretched out."""
    evaluate = function(objective)
    stretched = np.array(HOME)
    stretched[5] = 0.0
    for q in (HOME, stretched, np.zeros(9)):
        p = hold_parameters(MODEL.pose(q)) if objective.name == "hold" else objective.parameters
        for part in evaluate(np.concatenate([q, np.zeros(18)]), p):
            assert np.all(np.isfinite(np.array(part)))


def test_the_tray_s_acceleration_is_that_of_the_hand():
    rng = np.random.default_rng(1)
    q, v, u = (ca.SX.sym(name, 9) for name in "qvu")
    symbolic = ca.Function("a", [q, v, u], [acceleration(Stage(MODEL, q, v, u))])
    state = HOME + rng.uniform(-0.5, 0.5, 9), rng.uniform(-1, 1, 9), rng.uniform(-1, 1, 9)

    def position(t):
        return MODEL.pose(state[0] + t * state[1] + 0.5 * t * t * state[2]).position

    h = 1e-4
    numeric = (position(h) - 2 * position(0.0) + position(-h)) / h**2
    np.testing.assert_allclose(np.array(symbolic(*state)).ravel(), numeric, atol=1e-5)


@pytest.mark.parametrize(
    "groups", [("ee",), ("ee.vx", "ee.vy", "ee.vz"), ("base",), ("joint",), ("base.vx", "ee.vz")]
)
def test_objectives_do_not_overwrite_a_command(groups):
    """Ten times the weight of everything autonomous changes the commanded channels by less than 1 %."""
    rng = np.random.default_rng(2)
    values = dict(zip(CHANNELS.names, rng.uniform(0.05, 0.2, 18) * rng.choice([-1, 1], 18), strict=True))
    mask = CHANNELS.mask(*groups)
    asked = np.array(list(values.values()))[mask]
    tracked = []
    for factor in (1.0, 10.0):
        weak = MpcSettings()
        names = ("base_velocity", "arm_velocity", "acceleration", "posture", "terminal_velocity")
        strong = replace(weak, **{name: factor * getattr(weak, name) for name in names})
        objectives = [scaled(objective, factor) for objective in everything()]
        motion = steer(objectives, groups, lambda time: values, steps=50, settings=strong)
        tracked.append([realised(q, v)[mask] for q, v in zip(*motion, strict=True)])
    change = np.linalg.norm(np.subtract(*tracked), axis=1)[10:]  # after the start at full acceleration
    assert change.max() < 0.01 * np.linalg.norm(asked)
    assert np.linalg.norm(tracked[0][-1] - asked) < 0.01 * np.linalg.norm(asked)


def test_objectives_rest_where_everything_is_commanded():
    for objective in everything():
        for groups in (("joint",), ("base", "ee")):
            assert not np.any(objective.weights(CHANNELS.mask(*groups))), objective.name
        assert np.any(objective.weights(np.zeros(CHANNELS.size, dtype=bool))), objective.name


def test_one_channel_of_the_base_takes_one_joint():
    """vx alone leaves the base a way; the arm, vx, the turn and one axis of the hand leave nothing."""
    arm_and_one = ("arm", "base.vx", "base.wz")
    assert leaves_freedom(CHANNELS, CHANNELS.mask(*arm_and_one))
    assert not leaves_freedom(CHANNELS, CHANNELS.mask(*arm_and_one, "ee.vx"))
    assert not leaves_freedom(CHANNELS, CHANNELS.mask("arm", "base"))


def drift(positions):
    return max(np.linalg.norm(MODEL.pose(q).position - HAND.position) for q in positions)


def test_hold_keeps_the_hand_where_it_is_while_the_base_drives():
    drive = {"base.vx": 0.15, "base.vy": 0.1}
    hold = end_effector_hold(CHANNELS, position=20.0, orientation=20.0)
    without, _ = steer([], ("base",), lambda time: drive)
    held, _ = steer([hold], ("base",), lambda time: drive)
    point_only, _ = steer([end_effector_hold(CHANNELS, position=20.0)], ("base",), lambda time: drive)
    assert drift(without) > 0.5
    assert drift(held) < 0.03
    assert drift(point_only) < 0.03
    assert np.trace(HAND.rotation.T @ MODEL.pose(held[-1]).rotation) > 2.99
    assert np.trace(HAND.rotation.T @ MODEL.pose(point_only[-1]).rotation) < 2.99


def tilt(q):
    return np.degrees(np.arccos(np.clip((MODEL.pose(q).rotation @ UP)[2], -1.0, 1.0)))


def test_the_tray_stays_level_while_the_hand_moves():
    move, groups = {"ee.vx": 0.1, "ee.vy": 0.2, "ee.vz": -0.08}, ("ee.vx", "ee.vy", "ee.vz")
    without, _ = steer([], groups, lambda time: move)
    level, _ = steer([tray_levelling(CHANNELS, UP)], groups, lambda time: move)
    assert max(map(tilt, without)) > 10.0
    assert max(map(tilt, level)) < 3.0


def slip(positions, velocities):
    """Return the largest tangential over normal force on the tray."""
    linear = np.array([MODEL.jacobian(q)[:3] @ v for q, v in zip(positions, velocities, strict=True)])
    ratios = []
    for a, q in zip(np.diff(linear, axis=0) / PERIOD, positions[1:], strict=True):
        normal = MODEL.pose(q).rotation @ UP
        force = a + [0.0, 0.0, GRAVITY]
        ratios.append(np.linalg.norm(force - (force @ normal) * normal) / (force @ normal))
    return max(ratios)


def test_the_tray_is_not_torn_away_when_the_base_turns_round():
    def to_and_fro(time):
        return {"base.vx": 0.3 if time % 4 < 2 else -0.3}

    without = steer([], ("base",), to_and_fro)
    careful = steer([tray_levelling(CHANNELS, UP, slip=1.0, friction=0.06)], ("base",), to_and_fro)
    assert slip(*without) > 0.09
    assert slip(*careful) < 0.065
    assert max(map(tilt, careful[0])) < 6.0


def test_a_switched_off_objective_changes_nothing():
    drive = {"base.vx": 0.15}
    hold = switchable(end_effector_hold(CHANNELS, position=20.0))
    without, _ = steer([], ("base",), lambda time: drive, steps=20)
    mpc_off = drive_with(hold, drive, on=False)
    np.testing.assert_allclose(mpc_off, without[-1], atol=1e-6)
    assert np.linalg.norm(MODEL.pose(drive_with(hold, drive, on=True)).position - HAND.position) < 0.03


def drive_with(hold, values, on):
    PLACES["switched"] = switched(hold_parameters(HAND), on)
    return steer([replace(hold, name="switched")], ("base",), lambda time: values, steps=20)[0][-1]
