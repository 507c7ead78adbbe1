"""The same twist in the usual frames: what the robot does is the same, or there is no answer."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from arbiter_helpers import ONE, TWO, channels_of

from handrail.controllers.baselines.cbf_filter import CbfFilter
from handrail.controllers.baselines.unprotected import unprotected_controller
from handrail.controllers.interface.channel_matrix import channel_matrix
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.usual_frames import in_usual_frames
from handrail.controllers.objectives.objective import Stage
from handrail.controllers.objectives.tracking import channel_velocities


def realised(model):
    """Return the function of q, v and the frames' parameters to the velocity of every channel."""
    q, v, u = (ca.SX.sym(name, model.size) for name in "qvu")
    p = ca.SX.sym("p", 5)
    return ca.Function("c", [q, v, p], [channel_velocities(Stage(model, q, v, u), channels_of(model), p)])


ROBOTS = {"one hand": (ONE, realised(ONE)), "two hands": (TWO, realised(TWO))}
both = pytest.mark.parametrize("robot", ROBOTS)


def drawn(rng, model):
    return rng.uniform(-1.5, 1.5, model.size), rng.uniform(-1.0, 1.0, model.size)


def whole_parts(rng, channels, point):
    """Draw a mask that has each translation and each rotation wholly, or not at all."""
    mask = rng.random(channels.size) < 0.5
    mask[1] = mask[0]
    twists = [channels.hand_slice(hand) for hand in range(len(channels.hands))]
    for twist in [*twists, channels.pair_slice] if channels.pair else twists:
        mask[twist.start : twist.start + 3], turns = rng.random() < 0.5, rng.random() < 0.5
        mask[twist.start + 3 : twist.start + 6] = turns or (mask[twist.start] and bool(np.any(point)))
    return mask


@both
@pytest.mark.parametrize("tool", ["world", "tool"])
@pytest.mark.parametrize("base", ["base", "world"])
@pytest.mark.parametrize("far", [0.0, 0.4])
def test_the_robot_that_does_as_asked_does_the_same_in_usual_frames(robot, base, tool, far):
    (model, function), rng = ROBOTS[robot], np.random.default_rng(5)
    channels = channels_of(model)
    for _ in range(10):
        q, v = drawn(rng, model)
        frames = Frames(base, tool, far * rng.uniform(-1, 1, 3))
        mask = whole_parts(rng, channels, frames.point)
        meant = np.array(function(q, v, frames.parameters)).ravel()
        asked = Intent(np.where(mask, meant, np.nan), mask, frames=frames)
        usual = in_usual_frames(asked, model, q)
        assert usual is not None
        assert usual.frames.parameters.tolist() == Frames().parameters.tolist()
        assert np.array_equal(usual.mask, mask)
        expected = channel_matrix(model, channels, q) @ v
        assert np.allclose(usual.values[mask], expected[mask], atol=1e-8)


@both
def test_the_matrix_is_that_of_the_objective(robot):
    (model, function), rng = ROBOTS[robot], np.random.default_rng(6)
    for _ in range(10):
        q, v = drawn(rng, model)
        expected = np.array(function(q, v, Frames().parameters)).ravel()
        assert np.allclose(channel_matrix(model, channels_of(model), q) @ v, expected, atol=1e-6)


@both
@pytest.mark.parametrize(
    ("frames", "lacks"),
    [
        (Frames(tool="tool"), [".vx"]),
        (Frames(tool="tool"), [".wx", ".wy"]),
        (Frames(base="world"), ["base.vy"]),
        (Frames(point=np.array([0.1, 0.0, 0.0])), [".wx", ".wy", ".wz"]),
    ],
)
def test_a_twist_with_missing_axes_of_its_own_frame_has_no_usual_one(robot, frames, lacks):
    model = ROBOTS[robot][0]
    channels = channels_of(model)
    hand = channels.hands[-1][0].split(".")[0]
    missing = [name if name.startswith("base") else hand + name for name in lacks]
    mask = channels.mask("base", hand) & ~channels.mask(*missing)
    intent = Intent(np.ones(channels.size), mask, frames=frames)
    assert in_usual_frames(intent, model, np.ones(model.size)) is None
    nevertheless = in_usual_frames(intent, model, np.ones(model.size), exactly=False)
    assert nevertheless is not None  # what a dataset has of it
    whole = replace(intent, values=np.where(mask, 1.0, 0.0), mask=np.ones_like(mask))
    expected = in_usual_frames(whole, model, np.ones(model.size))
    assert expected is not None
    np.testing.assert_allclose(nevertheless.values[mask], expected.values[mask])
    assert np.array_equal(nevertheless.mask, mask)


@both
def test_a_hand_that_is_in_its_usual_frame_needs_no_turn(robot):
    """Some axes of it, beside a base that is meant in the world."""
    model = ROBOTS[robot][0]
    channels = channels_of(model)
    hand = channels.hands[-1][0].split(".")[0]
    mask = channels.mask("base", f"{hand}.vx", f"{hand}.wz")
    asked = Intent(0.1 * mask, mask, frames=Frames(base="world"))
    usual = in_usual_frames(asked, model, np.ones(model.size))
    assert usual is not None
    np.testing.assert_array_equal(usual.values[3:], asked.values[3:])
    np.testing.assert_allclose(
        usual.values[:2], 0.1 * np.array([np.cos(1) + np.sin(1), np.cos(1) - np.sin(1)])
    )


@both
@pytest.mark.parametrize("build", [unprotected_controller, CbfFilter])
def test_controllers_of_any_mask_do_the_same_in_any_frame(robot, build):
    """And brake where only its own frame can say what is asked."""
    model, rng = ROBOTS[robot][0], np.random.default_rng(7)
    controller, channels = build(model), channels_of(model)

    def sent(asked):
        controller.reset()
        command = controller.update(State(model.description.home, np.zeros(model.size), 1.0), asked)
        return command.velocities[1], command.diagnostics.status.brakes

    for _ in range(5):
        frames = Frames("world", "tool", 0.3 * rng.uniform(-1, 1, 3))
        mask = whole_parts(rng, channels, frames.point)
        asked = Intent(
            np.where(mask, rng.uniform(-0.1, 0.1, channels.size), 0.0), mask, time=1.0, frames=frames
        )
        usual = in_usual_frames(asked, model, model.description.home)
        assert usual is not None
        (velocity, brakes), (expected, _) = sent(asked), sent(usual)
        assert not brakes
        assert np.allclose(velocity, expected, atol=1e-9)
    sideways = channels.mask(f"{channels.hands[-1][0].split('.')[0]}.vy")
    assert sent(Intent(0.1 * sideways, sideways, time=1.0, frames=Frames(tool="tool")))[1]


@pytest.mark.parametrize(
    "asked",
    [
        Intent(np.zeros(3), np.ones(3, bool), frames=Frames(tool="tool")),
        Intent(np.zeros(channels_of(ONE).size), np.ones(channels_of(ONE).size, bool), frames=Frames("moon")),
    ],
)
def test_an_intent_that_no_controller_accepts_stays(asked):
    assert in_usual_frames(asked, ONE, ONE.description.home) is asked
