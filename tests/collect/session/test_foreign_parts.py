"""Laws of parts from outside: whatever they say, the robot brakes, or it is one line."""

from dataclasses import replace

import numpy as np
import pytest
from collect_helpers import Watcher

from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES, TeleopMode, always
from handrail.collect.session.build import build_env, build_mode, build_operator
from handrail.collect.session.session import Session
from handrail.controllers.baselines.catalogue import ControllerSpec
from handrail.controllers.baselines.twist_completion import TwistController, WholeBodyCompletion
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.command import Command, Status
from handrail.controllers.robot.model import load_model
from handrail.datasets.recording.frames import frame_row

CONFIG, MODEL = SessionConfig(task="reach", physics=False, time_limit=1.0), load_model()
STICKS = build_operator(CONFIG, MODES["ee"], MODEL)
TABLE_ONLY = ControllerSpec("arm", lambda model, period: None, "of a table", fits=lambda robot: False)
ARM = TeleopMode("arm", always("hand"), f"{__name__}:TABLE_ONLY", "an arm on a table")
LIMBED = ControllerSpec("limbs", TABLE_ONLY.build, "of limbs", fits=lambda robot: robot.limbs > 1)
LIMBS = TeleopMode("limbs", always("hand"), f"{__name__}:LIMBED", "many limbs")
STAFF = TeleopMode("staff", always("hand"), "mpc", "with a staff", module="no_such.staff")
WAND = TeleopMode("wand", always("hand"), "mpc", "with a wand", module="no_such_wand")


def run(controller, operator=STICKS):
    env, watcher = build_env(CONFIG, 20), Watcher()
    try:
        return Session(env, controller, operator, [watcher]).run(0), watcher.frames
    finally:
        env.close()


class Changed(TwistController):
    """Damped least squares, whose commands are changed."""

    def __init__(self, change):
        super().__init__(MODEL, WholeBodyCompletion(MODEL))
        self._change = change

    def update(self, state, intent):
        return self._change(super().update(state, intent))


def with_gap(command):
    velocities = np.array(command.velocities)
    velocities[-1, 2] = np.nan
    return replace(command, velocities=velocities)


def singular(q, previous, twist, period):
    raise np.linalg.LinAlgError("Singular matrix")


@pytest.mark.parametrize(
    "controller",
    [
        Changed(with_gap),
        Changed(lambda command: replace(command, velocities=np.full_like(command.velocities, np.inf))),
        Changed(lambda command: replace(command, grippers=(np.inf,))),
        Changed(lambda command: replace(command, elapsed=np.nan)),
        *(
            TwistController(MODEL, rule)
            for rule in (
                lambda *asked: np.full(9, np.nan),
                lambda *asked: np.zeros(6),
                lambda *asked: None,
                singular,
            )
        ),
    ],
)
def test_a_command_that_is_no_number_is_a_brake_that_counts(controller):
    outcome, frames = run(controller)
    assert outcome.brakes == outcome.frames == len(frames)
    for frame in frames:
        assert frame.diagnostics.status is Status.SOLVER_FAILED
        assert not frame.action[:-1].any()
        for name, values in frame_row(frame).items():
            assert isinstance(values, str) or np.isfinite(values).all(), name


@pytest.mark.parametrize(
    ("change", "got"),
    [
        (
            lambda command: replace(command, velocities=command.velocities[:, :6]),
            "a Command with 6 velocities and 1 grippers",
        ),
        (
            lambda command: replace(command, grippers=(0.0, 0.0)),
            "a Command with 9 velocities and 2 grippers",
        ),
        (lambda command: np.zeros(9), "a ndarray"),
        (lambda command: None, "a NoneType"),
    ],
)
def test_a_command_of_another_size_is_refused_in_one_line(change, got):
    wanted = "controller Changed: expected a Command with 9 velocities and 1 grippers, got "
    with pytest.raises(HandrailError) as error:
        run(Changed(change))
    assert str(error.value) == wanted + got


def test_a_command_may_be_of_a_class_of_its_own():
    class Told(Command):
        """A command that says more."""

    assert run(Changed(lambda command: Told(**vars(command))))[0].brakes == 0


@pytest.mark.parametrize(
    ("mode", "told"),
    [
        ("LIMBS", "'RobotDescription' object has no attribute 'limbs'"),
        ("ARM", "its controller cannot drive ridgeback_ur10: of a table"),
        ("STAFF", "No module named 'no_such'"),
        ("WAND", "expected the package no_such_wand, found none; install it"),
    ],
)
def test_a_mode_that_does_not_fit_is_refused_in_one_line(mode, told):
    name = f"{__name__}:{mode}"
    with pytest.raises(HandrailError) as error:
        build_mode(replace(CONFIG, mode=name), MODEL)
    assert str(error.value) == f"mode {name}: {told}"


class Says:
    """An operator with one answer."""

    def __init__(self, answer):
        self._answer = answer

    def reset(self, view, rng):
        pass

    def act(self, view):
        return self._answer


@pytest.mark.parametrize(
    ("answer", "got"), [(None, "None"), ("success", "'success'"), (np.zeros(2), "array([0., 0.])")]
)
def test_an_operator_whose_answer_is_no_intent_is_refused_in_one_line(answer, got):
    with pytest.raises(HandrailError) as error:
        run(TwistController(MODEL, WholeBodyCompletion(MODEL)), Says(answer))
    assert str(error.value) == f"operator Says: expected an Intent or an EpisodeEvent, got {got}"
