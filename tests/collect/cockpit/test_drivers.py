"""Laws of who drives what, as the page says it: by weights, and the points that a policy's plan leads to."""

import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from places import ROOT

from handrail.collect.cockpit.ahead import AHEAD, hands_ahead
from handrail.collect.cockpit.drivers import drivers, of_person
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.sources import PERSON, POLICY, Intents, IntentSource, Preview
from handrail.controllers.robot.model import load_model

ROBOTS = ("ridgeback_ur10", "tiago_pro", "lekiwi")
PERIOD, ROWS = 0.05, 30


def robot(name):
    """Return a model, its channels, where it stands and its hands."""
    model = load_model(name)
    q = np.array(model.description.home)
    return (
        model,
        Channels.of(model.description),
        q,
        [model.pose(q, h.named("tool")) for h in model.description.hands],
    )


def shared(channels, own, policys, rows=None, times=None):
    """Return an intent of a person who owns some channels and a policy that wants some others."""
    size, its = channels.size, channels.mask(*policys)
    mine = channels.mask(*own) if own else np.zeros(size, bool)
    theirs = Intent(np.zeros(size), channels.mask(*own, *policys), grippers=(0.0,))
    values = np.where(its, 0.1, 0.0) if rows is None else rows[0]
    plan = None if rows is None else Preview(rows, PERIOD * np.arange(len(rows)) if times is None else times)
    sources = [
        IntentSource(PERSON, theirs, mine.astype(float)),
        IntentSource(POLICY, replace(theirs, values=values, mask=its), (~mine).astype(float), plan),
    ]
    made = Intents.of(sources, (0.0,) * len(channels.hands), theirs)
    return replace(made, of_grippers=(PERSON if own else POLICY,) * len(channels.hands))


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("own", [(), ("base",), ("ee",), ("base", "ee")])
def test_each_channel_has_the_drivers_that_weigh_on_it(name, own):
    model, channels, q, tools = robot(name)
    own = tuple(group for group in own if channels.have(group))
    policys = tuple(group for group in ("base", "ee") if channels.have(group))
    said = drivers(shared(channels, own, policys), model, tools, q)
    mine = channels.mask(*own) if own else np.zeros(channels.size, bool)
    assert said[PERSON] == np.flatnonzero(mine).tolist()
    assert said[POLICY] == np.flatnonzero(channels.mask(*policys) & ~mine).tolist()
    assert said["grippers"] == [PERSON if own else POLICY] * len(tools)
    assert all(bool(lead) == ("ee" not in own) for lead in said["leads"])


def test_nobody_drives_a_robot_that_brakes_and_a_plain_intent_is_the_persons():
    model, channels, q, tools = robot("ridgeback_ur10")
    nobody = {PERSON: [], POLICY: [], "grippers": [], "leads": [[]], "lead_base": []}
    assert drivers(None, model, tools, q) == nobody
    plain = Intent(np.zeros(channels.size), channels.mask("ee"))
    said = drivers(plain, model, tools, q)
    assert said == nobody | {PERSON: np.flatnonzero(plain.mask).tolist(), "grippers": [PERSON]}


@pytest.mark.parametrize(("name", "seed"), [*product(ROBOTS[:2], range(3))])
def test_a_plan_of_twists_leads_to_their_sum_and_one_of_joints_along_q(name, seed):
    model, channels, q, tools = robot(name)
    rng = np.random.default_rng(seed)
    drawn = rng.uniform(-0.1, 0.1, (ROWS, channels.size))
    twists = np.where(channels.mask("ee"), drawn, 0.0)
    said = drivers(shared(channels, (), ("ee",), twists), model, tools, q)
    for number, tool in enumerate(tools):
        whole = tool.position + PERIOD * twists[:, channels.hand_slice(number)][:, :3].sum(axis=0)
        np.testing.assert_allclose(said["leads"][number][-1], whole, atol=1e-3)
    joints = np.where(channels.mask("arm"), drawn, 0.0)
    said = drivers(shared(channels, (), ("arm",), joints), model, tools, q)
    there = q + PERIOD * joints[:, channels.joint_slice].sum(axis=0)
    for number, hand in enumerate(model.description.hands):
        np.testing.assert_allclose(
            said["leads"][number][-1], model.pose(there, hand.named("tool")).position, atol=1e-3
        )


def test_a_base_that_drives_and_turns_leads_along_a_circle():
    """`x = v sin(ωt) / ω`, `y = v (1 − cos ωt) / ω`, turned by the yaw at the beginning."""
    model, channels, q, tools = robot("ridgeback_ur10")
    rows = np.zeros((ROWS, channels.size))
    rows[:, [0, 2]] = v, w = 0.4, 0.5
    said = drivers(shared(channels, (), ("base",), rows), model, tools, q)
    turn = w * PERIOD * ROWS
    along = np.array([v * np.sin(turn) / w, v * (1 - np.cos(turn)) / w, turn])
    np.testing.assert_allclose(said["lead_base"][-1], q[:3] + along, atol=2e-3)
    assert said["leads"] == [[]]


def test_a_pair_that_is_led_stays_as_it_is():
    model, channels, q, tools = robot("tiago_pro")
    rows = np.zeros((ROWS, channels.size))
    rows[:, channels.pair_slice] = [0.1, 0.0, 0.1, 0.0, 0.0, 0.4, 0.0]
    said = drivers(shared(channels, (), ("pair",), rows), model, tools, q)
    left, right = (np.array(lead) for lead in said["leads"])
    apart = np.linalg.norm(left - right, axis=1)
    np.testing.assert_allclose(apart, np.linalg.norm(tools[0].position - tools[1].position), atol=2e-3)
    middle = (left + right)[-1] / 2 - (tools[0].position + tools[1].position) / 2
    np.testing.assert_allclose(middle, PERIOD * ROWS * rows[0, channels.pair_slice][:3], atol=2e-3)


def test_the_ghost_is_of_what_the_person_asks_for():
    model, channels, q, tools = robot("ridgeback_ur10")
    merged = shared(channels, ("base",), ("ee",))
    assert hands_ahead(model, merged, tools, q, AHEAD) != (None,)
    assert hands_ahead(model, of_person(merged), tools, q, AHEAD) == (None,)


# Machado, Oliveira, Fernandes (2009), severity 1: what those see who lack one kind of cones, linear RGB.
VISIONS = {
    "usual": np.eye(3),
    "no red": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "no green": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.01182, 0.04294, 0.968881],
    ],
    "no blue": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.3039],
    ],
}
FAR = 30.0  # a difference in CIELAB that nobody overlooks; 2.3 is just seen


def lab(colour, vision):
    """Return a colour 0xrrggbb as seen, in CIELAB (D65)."""
    share = np.array([colour >> 16, colour >> 8 & 255, colour & 255]) / 255
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    seen = np.clip(np.asarray(vision) @ linear, 0.0, 1.0)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    xyz = to_xyz @ seen / [0.9505, 1.0, 1.089]
    x, y, z = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("vision", VISIONS)
def test_the_policys_colour_is_nobody_elses_for_anybody(vision):
    page = ROOT / "collect" / "cockpit" / "page"
    text = "".join((page / name).read_text() for name in ("marks.js", "view.js"))
    colours = {name: int(code, 16) for name, code in re.findall(r"([A-Z]+) = 0x([0-9a-f]{6})", text)}
    policys = lab(colours.pop("POLICY"), VISIONS[vision])
    assert colours.keys() >= {"OWNED", "ASKED", "PLAN", "NEAR"}
    for name, colour in colours.items():
        assert np.linalg.norm(policys - lab(colour, VISIONS[vision])) > FAR, name
