"""The showcase's laws: one controller for all cases, safe and exact in each; files that say what happened."""

import json
from dataclasses import replace
from functools import cache

import av
import numpy as np
import pytest

from handrail.controllers.robot.model import load_model
from handrail.scripts.bench.cases.cases import cases
from handrail.scripts.bench.cases.showcase import (
    CASES,
    FPS,
    ShowcaseConfig,
    build_controller,
    run_case,
    showcase,
)


@cache
def controller(robot):
    """One object for all cases of a robot."""
    return build_controller(load_model(robot))


@cache
def run(name, seconds=0.0):
    case = cases()[name]
    return run_case(replace(case, seconds=seconds or case.seconds), controller(case.robot))


@pytest.mark.parametrize("name", [*CASES[:3], pytest.param("d", marks=pytest.mark.slow)])
def test_a_case_is_tracked_and_safe(name):
    trace = run(name)
    result = trace.summary()
    assert trace.outcome.success
    assert (result["contacts"], result["brakes"]) == (0, 0)
    assert result["tracking"]["share"] < 0.01
    assert result["smallest_distance_at_full_margin"]["value"] >= 0.09
    assert result["smallest_distance"]["value"] >= (0.01 if name == "d" else 0.09)  # torso and head
    assert np.all(np.abs(trace.q[:, :2]) < load_model(trace.case.robot).description.limits.position_upper[:2])


def test_the_base_goes_round_while_the_hand_keeps_its_course():
    trace = run("a")
    assert np.ptp(trace.q[:, 1]) > 0.3
    assert np.ptp(trace.hands[:, 0][:, 1]) < 0.02
    assert trace.hands[:, 0][-1, 0] - trace.hands[:, 0][0, 0] > 3.8


def test_the_arm_gives_way_while_the_base_keeps_its_course():
    trace = run("b")
    relative = trace.hands[:, 0] - np.pad(trace.q[:, :2], ((0, 0), (0, 1)))
    assert np.max(np.linalg.norm(relative - relative[0], axis=1)) > 0.15
    assert np.ptp(trace.q[:, 1]) < 0.005
    np.testing.assert_allclose(trace.q[-1, 0] - trace.q[0, 0], 2.5, atol=0.02)


@pytest.mark.parametrize(("name", "width"), [("c", 0.5), pytest.param("d", 0.3, marks=pytest.mark.slow)])
def test_hands_are_held_while_the_base_goes_round_in_a_circle(name, width):
    trace = run(name)
    assert trace.held_error.max() < 0.02
    assert np.linalg.norm(trace.q[-1, :2] - cases()[name].q[:2]) < 0.3
    np.testing.assert_allclose(np.ptp(trace.q[:, :2], axis=0), width, rtol=0.1)


def test_without_opengl_there_is_everything_but_the_video(tmp_path, monkeypatch):
    monkeypatch.setattr(
        "handrail.scripts.bench.cases.showcase.graphics_trouble", lambda: "cameras need OpenGL"
    )
    result = showcase(ShowcaseConfig("c", str(tmp_path), seconds=1.0))
    assert result["video"] == "none: cameras need OpenGL"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.json", "c.png"]
    assert json.loads((tmp_path / "c.json").read_text()) == result
    assert result["frames"] == FPS
    assert {"tracking", "smallest_distance", "solve_time_ms", "contacts", "hold"} <= set(result)


@pytest.mark.needs_gl
def test_the_video_has_a_picture_a_period(tmp_path):
    showcase(ShowcaseConfig("a", str(tmp_path), seconds=0.5))
    with av.open(str(tmp_path / "a.mp4")) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(pictures) == FPS // 2
    assert pictures[-1].std() > 20.0
