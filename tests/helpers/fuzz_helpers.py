"""Random clutter, movers, and random, rude intents, for the safety fuzz.

The robot is MuJoCo's, and its gate stands open: what the controller says is what is sent.
Contacts and distances are MuJoCo's too.
"""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from handrail.collect.world.plant import Gate
from handrail.collect.world.scene import Scene, SceneObject, Viewpoint
from handrail.collect.world.simulation import Simulation
from handrail.collect.world.tasks.reach import sample_movers
from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.sources import Intents, IntentSource
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.ocp.problem import Plan, Problem
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Shape
from handrail.controllers.solvers import real_time
from handrail.controllers.solvers.real_time import NOTHING_ACTIVE

PERIOD = 0.05  # [s]
CLEARANCE = 0.15  # of the robot at the start [m]


@dataclass
class FuzzResult:
    """What a run showed."""

    own: list[str] = field(default_factory=list)  # contacts with itself
    standing: list[str] = field(default_factory=list)  # with what stands still
    moving: list[str] = field(default_factory=list)  # with movers, which end the run: nothing stops them
    statuses: Counter[str] = field(default_factory=Counter)
    velocity_excess: float = 0.0  # over the limit, relative
    acceleration_excess: float = 0.0  # between consecutive commands, over the limit, relative
    travelled: float = 0.0  # way of the tool [m]


def cluttered(model: RobotModel, movers: int, rng: np.random.Generator) -> tuple[Scene, np.ndarray]:
    """Draw a start posture and things around the robot, none nearer than the clearance."""
    base, scale = len(model.description.base.joints), model.description.world.scale
    while True:
        q = np.array(model.description.home)
        q[:base] = rng.uniform([-1.5, -1.5, -3.0], [1.5, 1.5, 3.0])
        q[:2] *= scale
        q[base:] += rng.uniform(-0.7, 0.7, model.size - base)
        limits, own = model.description.limits, CollisionModel(model)
        inside = np.all((q > limits.position_lower) & (q < limits.position_upper))
        if inside and np.all(own.values(q[None])[0] > np.minimum(own.largest_margin, scale * 0.10)):
            break
    objects: list[SceneObject] = sample_movers(movers, model, q, rng)
    wanted = movers + int(rng.integers(4, 11))
    view = Viewpoint((-3, -3, 3), (0, 0, 0.5), 50.0)
    for _ in range(400):
        if len(objects) == wanted:
            break
        scene = Scene((*objects, _thing(f"thing_{len(objects)}", q, scale, rng)), view)
        around = CollisionModel(model, scene.obstacles())
        if np.all(around.values(q[None])[0] > np.minimum(around.largest_margin, scale * CLEARANCE)):
            objects = list(scene.objects)
    return Scene(tuple(objects), view), q


def _thing(name: str, q: np.ndarray, scale: float, rng: np.random.Generator) -> SceneObject:
    angle, distance = rng.uniform(-np.pi, np.pi), scale * rng.uniform(0.5, 2.2)
    x, y = q[0] + distance * np.cos(angle), q[1] + distance * np.sin(angle)
    height = scale * rng.uniform(0.2, 1.6)
    raised = scale * rng.uniform(0.0, 1.0) if rng.random() < 0.3 else 0.0  # a shelf or a lamp in the air
    if rng.random() < 0.5:
        shape = Shape("cylinder", [scale * rng.uniform(0.05, 0.25), height])
    else:
        shape = Shape("box", [*(scale * rng.uniform(0.1, 0.6, 2)), height])
    return SceneObject(name, shape, np.array([x, y, raised + height / 2]), rgba=(0.5, 0.5, 0.5, 1.0))


class OpenGate(Gate):
    """Sends what comes: nothing but the controller keeps the limits."""

    def limit(self, command, q):
        self.velocity = np.array(np.asarray(command)[: len(self.velocity)])
        return np.asarray(command)


class RudeOperator:
    """Full-speed, jerky, switching intents; now and then garbage, huge, stale, future, in no known frame."""

    def __init__(self, channels, limits, rng):
        self._channels, self._rng = channels, rng
        self._groups = [("ee",), ("base",), ("joint",), ("base", "ee"), channels.hands[0][:3], ()]
        self._groups.append((channels.joints[-3],))
        if channels.pair:
            self._groups += [
                ("left",),
                ("right",),
                ("pair",),
                ("pair", "apart"),
                ("base", "left", "right.arm"),
            ]
        hand = [1, 1, 1, 2, 2, 2]
        pair = [*hand, 1] if channels.pair else []
        self._full = np.concatenate([[1, 1, 0.4], hand * len(channels.hands), pair, limits.velocity])
        self._grippers = (0.0,) * len(channels.hands)
        self._until = 0.0

    def intent(self, time):
        rng, size = self._rng, self._channels.size
        if time >= self._until:
            self._until = time + rng.uniform(0.05, 2.0)
            self._mask = (
                self._channels.mask(*self._groups[rng.integers(len(self._groups))])
                if rng.random() < 0.8
                else (rng.random(size) < 0.4)
            )
            self._values = self._full * rng.choice([-1.0, 1.0, 0.0, 0.5], size)
            self._frames = Frames(
                rng.choice(["base", "world"]), rng.choice(["world", "tool"]), rng.uniform(-0.3, 0.3, 3)
            )
        return self._troubled(time)

    def _troubled(self, time):
        rng, size = self._rng, self._channels.size
        values, mask, frames, stamp = self._values, self._mask, self._frames, time
        trouble = rng.random()
        if trouble < 0.02:
            values = np.where(rng.random(size) < 0.3, rng.choice([np.nan, np.inf, -np.inf]), values)
        elif trouble < 0.04:
            values = values * 1e6
        elif trouble < 0.05:
            stamp = time - rng.uniform(0.3, 5.0)
        elif trouble < 0.06:
            stamp = time + rng.choice([0.5, 10.0, 1e18, np.nan])
        elif trouble < 0.07:
            frames = Frames("moon", "world")
        elif trouble < 0.08:
            values, mask = np.zeros(3), np.zeros(3, dtype=bool)
        elif trouble < 0.20:
            values = values + rng.normal(0, 0.5, size)
        return Intent(values, mask, self._grippers, time=stamp, frames=frames)


class RudePair:
    """Two rude sources as one intent, with random weights; the second is now and then a second late, or dead.

    They mean the same frames, but for trouble: else their sum is no intent, and the robot only brakes.
    """

    def __init__(self, channels, limits, rng):
        self._both = [RudeOperator(channels, limits, rng) for _ in range(2)]
        self._rng, self._size, self._until = rng, channels.size, 0.0

    def intent(self, time):
        rng = self._rng
        if time >= self._until:
            self._until = time + rng.uniform(0.05, 1.0)
            kinds = [0.0, 0.3, 1.0, 10.0, rng.random(self._size), 1.0 * (rng.random(self._size) < 0.5)]
            self._weights = [kinds[rng.integers(len(kinds))] for _ in range(2)]
            self._late = rng.choice([0.0, 1.0, time], p=[0.9, 0.05, 0.05])
        first, second = (each.intent(time) for each in self._both)
        if rng.random() < 0.99:
            second = replace(second, frames=first.frames)
        second = replace(second, time=min(second.time, time - self._late) if self._late else second.time)
        weights = self._weights if rng.random() < 0.99 else [rng.choice([np.nan, -1.0, np.inf]), 1.0]
        sources = [
            IntentSource(name, each, weight)
            for name, each, weight in zip(("person", "policy"), (first, second), weights, strict=True)
        ]
        return Intents.of(sources, first.grippers, first)


@dataclass
class SolverRecord:
    """How the plans of a controller fared."""

    updates: int = 0
    spent: int = 0  # updates whose work ended before all rows were met
    excess: float = 0.0  # over a position limit, relative to half its range, beyond what the plan says


@contextmanager
def watching(controller: MaskedMpc) -> Iterator[SolverRecord]:
    """Look at every plan."""
    record, solver, limits = SolverRecord(), controller.solver, controller.model.description.limits
    honest, half = solver.solve, 0.5 * (limits.position_upper - limits.position_lower)
    compiled = real_time.functions

    class WatchedCore:
        """The compiled core; counts updates whose work ended."""

        def __getattr__(self, name: str) -> Any:
            return getattr(compiled(), name)

        def solve_update(self, core: Any, collision: Any) -> None:
            compiled().solve_update(core, collision)
            record.spent += core.fields.work <= 0.0

    def solve(problem: Problem, guess: FloatArray, active: IntArray = NOTHING_ACTIVE) -> Plan:
        plan = honest(problem, guess, active)
        share = np.abs(plan.q[1:] - limits.position_lower - half) / half - 1.0
        record.updates += 1
        record.excess = max(record.excess, float(share.max()) - plan.limit_slack)
        return plan

    solver.solve = solve
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(real_time, "functions", WatchedCore)
        yield record
    solver.solve = honest


@contextmanager
def failing(controller: MaskedMpc, seed: int, share: float) -> Iterator[None]:
    """Let the solver fail at random, now and then for a while."""
    rng, honest, until = np.random.default_rng([seed, 2]), controller.solver.solve, 0

    def solve(problem: Problem, guess: FloatArray, active: IntArray = NOTHING_ACTIVE) -> Plan:
        nonlocal until
        if until > 0 or rng.random() < share:
            until = until - 1 if until else int(rng.integers(0, 20))
            raise HandrailError("the solver fails on purpose")
        return honest(problem, guess, active)

    controller.solver.solve = solve
    yield
    controller.solver.solve = honest


def run(
    model: RobotModel,
    controller,
    seed: int,
    seconds: float,
    movers: int = 0,
    gap: float = PERIOD,
    operator: type = RudeOperator,
) -> FuzzResult:
    """Drive a robot through a scene of a seed with whatever comes; return what happened.

    Args:
        model: of the robot.
        controller: asked every `gap`; in between the robot follows its last command.
        seed: of the scene and the intents.
        seconds: how long.
        movers: how many things move.
        gap: between two updates, a multiple of the robot's period [s].
        operator: who asks, of its channels, limits and a generator.
    """
    rng = np.random.default_rng([seed, movers])
    scene, q = cluttered(model, movers, rng)
    simulation = Simulation(model, scene, q, PERIOD, gate=OpenGate(model, PERIOD))
    controller.reset(scene.obstacles(0.0))
    limits, result = model.description.limits, FuzzResult()
    rude = operator(controller.channels, limits, rng)
    moving = {item.name for item in scene.movers}
    standing = {item.name for item in scene.objects} - moving | {"floor"}
    previous, every = np.zeros(model.size), round(gap / PERIOD)
    for step in range(int(seconds / PERIOD)):
        state, hand = simulation.state(), simulation.tools[0].position
        if step % every == 0:
            if movers:
                controller.update_scene(scene.obstacles(state.time))
            command = controller.update(state, rude.intent(state.time))
            result.statuses[command.diagnostics.status.value] += 1
        velocity = command.velocity((step % every + 1) * PERIOD)
        excess = np.abs(velocity) / limits.velocity - 1.0
        result.velocity_excess = max(result.velocity_excess, float(np.max(excess)))
        excess = np.abs(velocity - previous) / (limits.acceleration * PERIOD) - 1.0
        result.acceleration_excess = max(result.acceleration_excess, float(np.max(excess)))
        previous = velocity
        simulation.send(np.append(velocity, np.zeros(len(model.description.hands))))
        for pair in simulation.contacts:
            met = set(pair.split(" – "))
            kind = result.moving if met & moving else result.standing if met & standing else result.own
            kind.append(f"{pair} at {state.time:.2f} s, {command.diagnostics.status}")
        if result.moving:
            break
        result.travelled += float(np.linalg.norm(simulation.tools[0].position - hand))
    return result
