"""Laws of what the page shows of a moment: in words, where the intent leads, what is near, what is left."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from handrail.collect.cockpit.ahead import AHEAD, base_ahead, hands_ahead
from handrail.collect.cockpit.episodes import DiskRoom
from handrail.collect.cockpit.nearest import NearestPair
from handrail.collect.cockpit.snapshot import STATUS, Snapshots, reason
from handrail.collect.config import DatasetConfig, RecordConfig
from handrail.collect.operators.operator import View
from handrail.collect.operators.person.inputs import Ask
from handrail.collect.operators.person.person import Person
from handrail.collect.session.build import build_env, build_modes
from handrail.collect.world.gl import mujoco
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Diagnostics, Status
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.sources import Intents, IntentSource
from handrail.controllers.interface.trajectory import Trajectory
from handrail.controllers.numerics.rotation import rotation_vector
from handrail.datasets.recording.frames import Frame

CONFIG = RecordConfig(task="pick_place", mode="ee", dataset=DatasetConfig(place="somewhere"))


@pytest.fixture(scope="module")
def env():
    made = build_env(CONFIG, 20)
    made.reset(seed=3)
    yield made
    made.close()


@pytest.fixture
def person(env):
    return Person(env.model, build_modes(CONFIG, env), "ee")


def view(env):
    return View(env.plant.state(), env.task_state())


def asked(env, frames=Frames(), **values):  # noqa: B008
    channels = Channels.of(env.model.description)
    names = [name.replace("__", ".") for name in values]
    intent = Intent.idle(channels)
    numbers, mask = np.zeros(channels.size), channels.mask(*names)
    for name, value in zip(names, values.values(), strict=True):
        numbers[channels.names.index(name)] = value
    return replace(intent, values=numbers, mask=mask, frames=frames)


def frame(env):
    """Return a frame of a hand that is led, and a plan."""
    plan = Trajectory(np.full((21, env.model.size), 0.1), 0.1)
    nothing = np.zeros(env.model.size + 1)
    return Frame(
        state=nothing,
        environment=nothing,
        images={},
        intent=asked(env, ee__vx=0.1),
        action=nothing,
        command=nothing,
        diagnostics=Diagnostics(),
        contacts=0,
        success=False,
        done=False,
        wall_clock=0.0,
        number=0,
        safe=0,
        plan=plan,
    )


@pytest.mark.parametrize("status", list(Status))
def test_every_brake_has_a_reason(env, status):
    words = reason(status, (), env.model.description.home, env.model.description)
    assert words == STATUS[status]
    assert words.startswith("braking: ") == status.brakes


def test_contacts_and_joints_at_their_limits_are_named(env):
    limits, q = env.model.description.limits, np.array(env.model.description.home)
    elbow = int(np.flatnonzero(np.isfinite(limits.position_lower))[-1])
    q[elbow] = limits.position_lower[elbow]
    words = reason(Status.BACKUP, ["bin_table – forearm"], q, env.model.description)
    assert words.startswith(STATUS[Status.BACKUP])
    assert "touching: bin table – forearm" in words
    assert "edge" not in words
    q[0] = limits.position_lower[0]
    assert "base at the edge" in reason(Status.OK, (), q, env.model.description)
    assert env.model.joints[elbow].removesuffix("_joint").replace("_", " ") + " at its limit" in words


def ahead(env, intent, q=None):
    """Return the hand's pose and the base's to which an intent leads."""
    now = view(env)
    q = now.state.q if q is None else q
    return *hands_ahead(env.model, intent, [now.tool], q), base_ahead(env.model, intent, q)


def test_the_hand_leads_where_it_is_asked_to_go_and_turn(env):
    tool = view(env).tool
    hand, base = ahead(env, asked(env, ee__vz=0.2, ee__wz=0.5))
    assert base is None
    np.testing.assert_allclose(hand.position - tool.position, [0, 0, 0.2 * AHEAD])
    turn = rotation_vector(hand.rotation @ tool.rotation.T)
    np.testing.assert_allclose(turn, [0, 0, 0.5 * AHEAD], atol=1e-9)
    own, _ = ahead(env, asked(env, Frames(tool="tool"), ee__vz=0.2))
    along = tool.position + 0.2 * AHEAD * tool.rotation[:, 2]
    np.testing.assert_allclose(own.position, along, atol=1e-12)


def test_joints_lead_the_hand_and_a_base_leads_as_it_is_turned(env):
    q = np.array(view(env).state.q)
    q[-1] += 0.5 * AHEAD
    hand, _ = ahead(env, asked(env, **{f"joint__{env.model.joints[-1]}": 0.5}))
    np.testing.assert_allclose(hand.rotation, env.model.pose(q).rotation, atol=1e-12)
    turned = np.array(view(env).state.q)
    turned[2] = math.pi / 2
    hand, base = ahead(env, asked(env, base__vx=0.5), turned)
    assert hand is None
    assert base is not None
    np.testing.assert_allclose(base - turned[:3], [0, 0.5 * AHEAD, 0], atol=1e-12)


def test_at_rest_nothing_leads_anywhere(env):
    assert ahead(env, asked(env, ee__vx=0.0, base__vx=0.0)) == (None, None)


def test_the_nearest_pair_is_the_nearest_of_all(env):
    """Measured against a search that leaves nothing out."""
    model, data = env.simulation.mujoco_model, env.simulation.data
    found = NearestPair(model).find(data)
    own = list(zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True))
    robot = sorted({geom for pair in own for geom in pair})
    roots = {int(model.body_rootid[model.geom_bodyid[geom]]) for geom in robot}
    solid = (model.geom_contype | model.geom_conaffinity) > 0
    scene = [
        geom
        for geom in np.flatnonzero(solid & (model.geom_bodyid > 0)).tolist()
        if int(model.body_rootid[model.geom_bodyid[geom]]) not in roots
        and not model.body_dofnum[model.geom_bodyid[geom]]  # what is meant to be taken
    ]
    line = np.zeros(6)
    pairs = own + [(first, second) for first in robot for second in scene]
    best = min(mujoco.mj_geomDistance(model, data, *pair, 0.5, line) for pair in pairs)
    assert found is not None
    assert found["distance"] == pytest.approx(best, abs=1e-4)
    assert np.linalg.norm(np.subtract(found["points"][:3], found["points"][3:])) == pytest.approx(
        best, abs=3e-3
    )
    assert all(found["names"])


def test_a_moment_is_small_and_finite(env, person):
    snapshots = Snapshots(env)
    snapshots.see(frame(env))
    text = json.dumps(snapshots.now(view(env), person, 1.0), allow_nan=False)
    said = json.loads(text)
    assert [len(ghost) for ghost in said["ghosts"]] == [7]
    assert len(said["paths"][0]) == len(said["track"]) > 5
    assert len(text) < 6000


def test_drivers_are_said_beside_a_policy_alone_and_only_while_the_robot_is_driven(env, person):
    plain, beside, moment = Snapshots(env), Snapshots(env, shared=True), frame(env)
    moment = replace(
        moment, intent=Intents.of([IntentSource("policy", moment.intent)], (0.0,), moment.intent)
    )

    def policys():
        return beside.now(view(env), person, 0.0)["drivers"]["policy"]

    for each in (plain, beside):
        each.see(moment)
    assert not policys()  # before Start
    person.ask(Ask("start"))
    assert policys() == np.flatnonzero(moment.intent.mask).tolist()
    assert "drivers" not in plain.now(view(env), person, 0.0)
    beside.see(replace(moment, diagnostics=Diagnostics(Status.STALE_INTENT)))
    assert not policys()


def test_an_undo_takes_what_came_since_the_robot_went_on(env, person):
    snapshots, now = Snapshots(env), view(env)
    at = lambda time, moving: replace(  # noqa: E731
        now, state=replace(now.state, time=time, commanded=np.full(env.model.size, float(moving)))
    )
    assert snapshots.now(at(0.0, False), person, 0.0)["undo_takes"] == 0.0
    person.ask(Ask("start"))
    assert snapshots.now(at(0.0, False), person, 0.0)["undo_takes"] == 0.0
    assert snapshots.now(at(3.0, True), person, 0.0)["undo_takes"] == 3.0
    person.ask(Ask("pause"))
    assert snapshots.now(at(4.0, True), person, 0.0)["undo_takes"] == 4.0  # still braking
    assert snapshots.now(at(4.5, False), person, 0.0)["undo_takes"] == 4.5  # in the pause, too
    person.ask(Ask("start"))
    assert snapshots.now(at(4.5, False), person, 0.0)["undo_takes"] == 0.0
    assert snapshots.now(at(6.0, True), person, 0.0)["undo_takes"] == 1.5


def test_after_an_undo_nothing_is_drawn_of_what_has_never_been(env, person):
    snapshots, now = Snapshots(env), view(env)
    at = lambda time: replace(now, state=replace(now.state, time=time))  # noqa: E731
    person.ask(Ask("start"))
    snapshots.see(frame(env))
    driven = snapshots.now(at(3.0), person, 0.0)
    assert driven["ghosts"][0]
    assert driven["track"]
    assert driven["undos"] == 0
    for undos in (1, 2):
        undone = snapshots.now(at(1.0 / undos), person, 0.0)
        assert not any(undone["ghosts"] + undone["paths"])
        assert not undone["track"]
        assert undone["undos"] == undos


def test_the_disk_says_how_many_episodes_fit(tmp_path):
    folder = tmp_path / "to" / "come"
    room = DiskRoom(folder)
    assert room.left[0] > 0
    assert room.left[1] == -1
    folder.mkdir(parents=True)
    (folder / "data").write_bytes(bytes(2_000_000))
    room.measure(2)
    free, episodes = room.left
    assert episodes == pytest.approx(free / 1_000_000, rel=0.1)
