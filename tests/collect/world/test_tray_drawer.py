"""Tray and drawer: what they sample, how they judge, and that they can be done."""

from dataclasses import replace

import numpy as np
import pytest
from collect_helpers import environment, episode, hold, moved

from handrail.collect.seeds import episode_seed
from handrail.collect.world.task import Start
from handrail.collect.world.tasks.drawer import HANDLE, TRAVEL, Drawer, handle, inward, opened
from handrail.collect.world.tasks.tray import Tray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.robot.description import robot_names
from handrail.controllers.robot.model import load_model

MODEL = load_model()
ROBOTS = [name for name in robot_names() if load_model(name).description.world.scale == 1.0]
SEEDS = range(30)


class Watcher:
    def __init__(self):
        self.env, self.tilt, self.masks, self.opening = None, 0.0, set(), []

    def begin(self, env, seed):
        self.env = env

    def see(self, frame):
        poses = self.env.task_state().poses
        self.masks.add(frame.intent.mask.tobytes())
        if "tray" in poses:
            self.tilt = max(self.tilt, float(np.arccos(min(poses["tray"].rotation[2, 2], 1.0))))
        else:
            self.opening.append(opened(self.env.task_state()))


def run(task, mode="ee", noise=0.0, seed=1, robot="ridgeback_ur10"):
    watcher = Watcher()
    return episode(seed, watcher, task=task, mode=mode, noise=noise, robot=robot), watcher


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_perfect_operator_carries_the_tray_level(robot):
    outcome, watcher = run("tray", robot=robot)
    assert outcome.success, outcome
    assert outcome.contact_onsets == 0
    assert watcher.tilt < 0.1
    (mask,) = {np.frombuffer(mask, dtype=bool).sum() for mask in watcher.masks}
    assert mask == 4  # where and which way; the tilt is the MPC's


def test_the_task_s_objectives_are_a_condition_of_their_own():
    """Without them the hand is steered whole, and a perfect operator who minds the can keeps it upright."""
    outcome, watcher = run("tray", mode="ee_whole")
    (mask,) = {np.frombuffer(mask, dtype=bool).sum() for mask in watcher.masks}
    assert mask == 6
    assert outcome.contact_onsets == 0
    assert outcome.success, outcome
    assert watcher.tilt < 0.1


def test_a_driver_with_a_tray_minds_its_height():
    """The arm begins nearer to itself than the MPC likes; left alone it would lower the hand by 0.2 m."""
    outcome, watcher = run("tray", mode="switching", noise=1.0, seed=episode_seed(900, 2))
    assert outcome.success, outcome
    driving, steering = sorted(np.frombuffer(mask, dtype=bool).sum() for mask in watcher.masks)
    assert (driving, steering) == (4, 4)  # base and height; where the hand is and which way it points


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_perfect_operator_opens_the_drawer(robot):
    outcome, watcher = run("drawer", robot=robot)
    assert outcome.success, outcome
    assert outcome.contact_onsets == 0
    assert 0.2 <= watcher.opening[-1] <= TRAVEL
    assert watcher.opening[0] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_gripper_holds_the_tray_and_dropping_it_fails(robot):
    """Measured in the hand: a hand that sinks under the weight takes the tray along."""
    with environment("Tray", robot=robot) as env:
        for seed in range(4):
            env.reset(seed=seed)
            before = in_hand(env.task_state())
            info = hold(env, 60, 1.0)
            assert info["failure_reason"] == ""
            assert info["contacts"] == 0
            assert np.linalg.norm(in_hand(env.task_state()) - before) < 0.001
        assert hold(env, 60, 0.0)["failure_reason"] == "tray_dropped"


def in_hand(state):
    return state.tool.rotation.T @ (state.pose("tray").position - state.tool.position)


@pytest.mark.parametrize("offset", [[0.30, 0.0, 0.1], [0.0, 0.0, -0.3]])
def test_a_can_beside_or_under_the_tray_fails(offset):
    with environment("Tray") as env:
        env.reset(seed=0)
        start = env.start
        place = start.scene.find("tray").position + offset
        scene = moved(start, "can", place).scene
        env.reset(options={"start": replace(start, scene=scene)})
        assert hold(env, 5, 1.0)["failure_reason"] == "can_fell"


def test_a_tilted_hand_spills_the_can():
    with environment("Tray") as env:
        env.reset(seed=0)
        wrist = np.zeros(env.model.size)
        wrist[6] = 0.8  # a quarter turn in two seconds
        assert hold(env, 60, 1.0, wrist)["failure_reason"] == "can_fell"


@pytest.mark.parametrize(("grip", "success"), [(None, True), (0.0, False)])
def test_the_tray_has_to_be_left_on_the_table(grip, success):
    with environment("Tray") as env:
        env.reset(seed=0)
        start = env.start
        table, tray, can = (start.scene.find(name) for name in ("table", "tray", "can"))
        place = np.array([*table.position[:2], table.top + 0.012])
        on_it = place + tray.rotation.T @ (can.position - tray.position)
        scene = moved(start, "tray", place).scene
        scene = moved(Start(scene, start.q), "can", on_it).scene
        env.reset(options={"start": Start(scene, start.q, grip=(grip,))})
        info = hold(env, 40, float(grip is not None))
        assert info["is_success"] == success, info


@pytest.mark.parametrize("robot", ROBOTS)
def test_tray_scenes_follow_their_description(robot):
    model, sides = load_model(robot), set()
    for seed in (*SEEDS, 160, 165):  # 165: the UR10 cannot hold the tray at the first place drawn
        start = Tray().sample(model, np.random.default_rng(seed))
        table, tray = start.scene.find("table"), start.scene.find("tray")
        sides.add(float(np.sign(table.position[1])))
        assert start.q[1] * table.position[1] < 0  # it has to cross
        assert 0.55 <= table.top <= 0.65
        assert tray.rotation[2, 2] == pytest.approx(1.0, abs=1e-3)
        assert len([item for item in start.scene.objects if item.name.startswith("obstacle")]) in (2, 3)
        tool = model.pose(start.q).position
        np.testing.assert_allclose(tool - tray.position, [0, 0, 0.2], atol=1e-3)
    assert sides == {-1.0, 1.0}


@pytest.mark.parametrize("hand", ["left", "right"])
def test_a_tray_starts_clear_of_the_idle_hand(hand):
    """By 5 cm, fingers included."""
    model, idle = load_model("tiago_pro").with_hand(hand), {"left": "right", "right": "left"}[hand]
    for seed in SEEDS:
        start = Tray().sample(model, np.random.default_rng(seed))
        collision = CollisionModel(model, (start.scene.find("tray").obstacle(),))
        near = collision.values(start.q[None])[0]
        rows = [row for row, (a, b) in enumerate(collision.pairs) if b == "tray" and a.startswith(idle)]
        assert rows
        assert near[rows].min() > 0.05


def test_drawer_scenes_follow_their_description():
    for seed in SEEDS:
        scene = Drawer().sample(MODEL, np.random.default_rng(seed)).scene
        drawer, body = scene.find("drawer"), scene.find("cabinet")
        place = drawer.position + drawer.rotation @ HANDLE
        assert 0.63 <= place[2] <= 0.84
        assert abs(np.arctan2(*inward(body.rotation)[1::-1])) <= 0.3
        assert [item.name for item in scene.obstacles()] == ["cabinet"]


def test_a_drawer_stays_shut_opens_along_its_rail_and_stops_at_its_end():
    with environment("Drawer") as env:
        env.reset(seed=3)
        hold(env, 20, 0.0)
        state = env.task_state()
        assert abs(opened(state)) < 1e-4
        shut, into = handle(state), inward(state.object("cabinet").rotation)
        joint = env.simulation.data.joint("drawer")
        joint.qfrc_applied[:] = 1.0  # less than the rail's friction
        hold(env, 40, 0.0)
        assert abs(opened(env.task_state())) < 2e-3
        for push in (12.0, 40.0):
            joint.qfrc_applied[:] = push
            hold(env, 60, 1.0)
        state = env.task_state()
        assert opened(state) == pytest.approx(TRAVEL, abs=0.01)
        np.testing.assert_allclose(handle(state) - shut, -opened(state) * into, atol=1e-6)
        assert "drawer" in env.task_state().still


def test_the_drawer_counts_only_when_the_hand_has_let_go():
    with environment("Drawer") as env:
        env.reset(seed=3)
        env.simulation.data.joint("drawer").qfrc_applied[:] = 40.0
        assert not hold(env, 40, 1.0)["is_success"]  # open, but the gripper is closed
        assert opened(env.task_state()) > 0.2
        assert hold(env, 40, 0.0)["is_success"]


def test_a_thing_weighs_what_the_task_says():
    """Mass is spread over parts by volume; either way the body weighs what the task says."""
    for task, names in (("Tray", ("tray", "can")), ("Drawer", ("drawer",))):
        with environment(task) as env:
            env.reset(seed=0)
            for name in names:
                body = env.simulation.mujoco_model.body(name)
                assert body.mass[0] == pytest.approx(env.start.scene.find(name).mass)
