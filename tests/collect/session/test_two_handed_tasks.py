"""Tasks of two hands: a scripted person does them in each mode that fits; a pair stays together."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from collect_helpers import Watcher

from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_controller, build_env, build_session
from handrail.collect.world.tasks.carry_box import GRASP, SIZE
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import Pose

ROBOT = "tiago_pro"


SPEED = 0.08  # of the base [m/s]


@pytest.mark.parametrize(
    ("task", "mode"),
    [("carry_box", "pair"), ("carry_box", "both"), ("carry_box", "direct"), ("wide_tray", "pair")],
)
def test_a_person_does_it_with_both_hands(task, mode):
    config, watcher = SessionConfig(task=task, mode=mode, robot=ROBOT), Watcher()
    env = build_env(config, 20)
    outcome = build_session(config, env, (watcher,)).run(1)
    assert outcome.success, outcome
    assert mode == "direct" or outcome.contact_onsets == 0  # which nothing keeps from
    assert {frame.intent.grippers for frame in watcher.frames} == {(0.0, 0.0), (1.0, 1.0)}
    channels = Channels.of(env.model.description)
    mask = channels.mask(*MODES[mode].owned("hand"))
    if task == "wide_tray":
        mask &= ~channels.mask("pair.wx", "pair.wy")  # which the MPC levels
    for frame in watcher.frames:
        np.testing.assert_array_equal(frame.intent.mask, mask)


def test_hands_are_led_to_the_box_then_to_where_it_stands_on_the_other_table():
    env = build_env(SessionConfig(task="carry_box", mode="pair", robot=ROBOT), 20)
    env.reset(seed=0)
    state = env.task_state()
    box, there = state.pose("box"), state.object("table").top_centre + np.array([0.0, 0.0, SIZE[2] / 2])

    def told(place, away):
        tools = tuple(Pose(place + GRASP + side * way, np.eye(3)) for side in (1, -1) for way in [away])
        now = replace(state, poses={**state.poses, "box": Pose(place, box.rotation)}, tools=tools)
        now = replace(now, openings=(1.0, 1.0), still=frozenset({"box"}))
        return env.task.aim(now), env.task.outcome(now).success

    far = np.array([0.0, 0.5, 0.0])
    aim, success = told(box.position, far)
    assert (aim.name, success) == ("box", False)
    assert told(box.position + [0.0, 0.0, 0.1], far)[0].name == "table"
    aim, success = told(there, far)
    assert success
    np.testing.assert_allclose(aim.position, there + GRASP)


def test_a_pair_stays_together_while_the_base_drives_a_circle():
    """Within 5 mm and 1 degree."""
    env = build_env(SessionConfig(task="carry_box", mode="pair", robot=ROBOT), 20)
    env.reset(seed=0)
    channels, controller = Channels.of(env.model.description), build_controller(MODES["pair"], env.model, 20)
    controller.reset()
    mask, values = channels.mask("base", "pair"), np.zeros(channels.size)

    def relative():
        one, other = env.plant.tools
        return other.rotation.T @ (one.position - other.position), other.rotation.T @ one.rotation

    (place, turn), middle = relative(), env.task_state().pair.position
    for step in range(200):
        state, angle = env.state(), 2 * np.pi * step / 200
        values[channels.base_slice] = [SPEED * np.cos(angle), SPEED * np.sin(angle), 0.0]
        command = controller.update(state, Intent(values, mask, mode="pair", time=state.time))
        env.step(np.append(command.velocity(env.period), [0.0, 0.0]))
        now, turned = relative()
        assert np.linalg.norm(now - place) < 0.005
        assert np.arccos(np.clip((np.trace(turned.T @ turn) - 1) / 2, -1, 1)) < np.radians(1.0)
    assert np.linalg.norm(env.task_state().pair.position - middle) < 0.02


def test_a_robot_with_one_hand_is_refused_in_a_line():
    with pytest.raises(HandrailError, match="task carry_box: expected a robot with 2 hands, got lekiwi"):
        build_env(SessionConfig(task="carry_box", robot="lekiwi"), 20)
    for name in ("CarryBox", "Fetch", "HandOver", "ReachBoth", "WideTray"):
        with pytest.raises(HandrailError, match="expected a robot with 2 hands, got ridgeback_ur10 with 1"):
            gymnasium.make(f"handrail/{name}-v0").reset(seed=0)
