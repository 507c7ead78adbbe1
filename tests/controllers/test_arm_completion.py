"""Damped least squares: it does what is asked where it can, and keeps the limits whatever is asked."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from handrail.controllers.baselines.arm_completion import (
    LARGEST_RATE,
    LARGEST_SPEED,
    ArmCompletion,
    WeldedBaseCompletion,
    clamp_twist,
)
from handrail.controllers.baselines.twist_completion import twist_controller
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import load_model

MODEL = load_model()
HOME = MODEL.description.home
LIMITS = MODEL.description.limits
PERIOD = 0.03
TWISTS = arrays(float, 6, elements=st.floats(-2.0, 2.0))
BASES = arrays(float, 3, elements=st.floats(-2.0, 2.0))


@given(TWISTS, BASES)
def test_the_tool_does_what_is_asked_whatever_the_base_does(twist, base):
    """Law: with hardly any damping J v = v_ee, and without a step's limits nothing else is changed."""
    arm = ArmCompletion(MODEL, damping=1e-12).arm_velocity(HOME, base, twist)
    assert np.allclose(MODEL.jacobian(HOME) @ np.concatenate([base, arm]), twist, atol=1e-6)


def test_damping_is_that_of_the_equation():
    """Law: the gradient of ‖J_a q̇ − e‖² + λ‖W q̇‖² vanishes at the solution."""
    twist, base = np.array([0.1, -0.2, 0.05, 0.3, 0.2, -0.1]), np.array([0.2, 0.1, -0.3])
    solution = ArmCompletion(MODEL, damping=0.05).arm_velocity(HOME, base, twist)
    J, W = MODEL.jacobian(HOME), np.diag(1.0 / LIMITS.velocity[3:])
    gradient = J[:, 3:].T @ (J[:, 3:] @ solution + J[:, :3] @ base - twist) + 0.05 * W @ W @ solution
    assert np.allclose(gradient, 0.0, atol=1e-12)


@given(arrays(float, 9, elements=st.floats(-1.0, 1.0)), BASES, TWISTS)
def test_limits_hold_for_anything(previous, base, twist):
    previous = previous * LIMITS.velocity
    v = ArmCompletion(MODEL).velocity(HOME, previous, base, twist, PERIOD)
    assert np.all(np.abs(v) <= LIMITS.velocity + 1e-9)
    assert np.all(np.abs(v - previous) <= LIMITS.acceleration * PERIOD + 1e-9)


@given(BASES)
def test_the_arm_makes_up_for_the_base_that_the_limits_leave(base):
    """Law: the arm answers to what the base will do, not to what was asked of it."""
    arm, step = ArmCompletion(MODEL), LIMITS.acceleration * PERIOD
    v = arm.velocity(HOME, np.zeros(9), base, np.zeros(6), PERIOD)
    assert np.allclose(v[:3], np.clip(base, -step[:3], step[:3]))
    assert np.allclose(v[3:], np.clip(arm.arm_velocity(HOME, v[:3], np.zeros(6)), -step[3:], step[3:]))


@given(arrays(float, 3, elements=st.floats(-0.1, 0.1)), st.floats(-3.0, 3.0))
def test_a_welded_base_makes_planar_motions_alone(planar, angle):
    """Law: for vx, vy, ωz of the tool the arm rests, wherever the base points."""
    q = HOME.copy()
    q[2] = angle
    twist = np.array([planar[0], planar[1], 0.0, 0.0, 0.0, planar[2]])
    v = WeldedBaseCompletion(MODEL)(q, np.zeros(9), twist, duration=10.0)
    assert np.allclose(v[3:], 0.0, atol=1e-9)
    assert np.allclose(MODEL.jacobian(q) @ v, twist, atol=1e-9)


@given(TWISTS)
def test_a_long_twist_is_shortened_and_keeps_its_direction(twist):
    clamped = clamp_twist(twist)
    for part, most in ((slice(0, 3), LARGEST_SPEED), (slice(3, 6), LARGEST_RATE)):
        length = np.linalg.norm(twist[part])
        assert np.linalg.norm(clamped[part]) == pytest.approx(min(length, most))
        assert np.allclose(clamped[part] * length, twist[part] * np.linalg.norm(clamped[part]))


def test_the_welded_base_is_a_controller():
    """Law: in closed form the tool moves as asked, with base and arm, once the limits let it."""
    controller = twist_controller(MODEL, WeldedBaseCompletion(MODEL, damping=1e-9), PERIOD)
    channels = Channels.of(MODEL.description)
    values = np.zeros(channels.size)
    twist = np.array([0.05, -0.02, 0.03, 0.05, -0.04, 0.06])
    values[channels.tool_slice] = twist
    q, v = HOME.copy(), np.zeros(9)
    for step in range(60):
        intent = Intent(values, channels.mask("ee"), time=step * PERIOD)
        v = controller.update(State(q, v, step * PERIOD), intent).velocity(PERIOD)
        achieved = MODEL.jacobian(q) @ v
        q = q + PERIOD * v
    assert np.allclose(achieved, twist, atol=1e-6)
    assert np.all(np.abs(v[:3]) > 0.0)
