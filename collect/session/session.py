"""The one loop that runs task, operator, controller and recorder: observe, ask, complete, act, record."""

import contextlib
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from handrail.collect.envs.env import HandrailEnv
from handrail.collect.operators.operator import Operator, View
from handrail.collect.simulation.simulation import Simulation
from handrail.controllers.interface.command import Command, Status
from handrail.controllers.interface.controller import Controller
from handrail.controllers.numerics.threads import single_threaded
from handrail.controllers.robot.model import RobotModel
from handrail.datasets.quality.safety import contacts_begun
from handrail.datasets.recording.frames import Frame


@dataclass(frozen=True)
class Outcome:
    """How an episode went.

    Attributes:
        seed: of the environment.
        success: whether the task was done.
        failure_reason: why not; empty after a success.
        frames: control periods.
        seconds: simulated time [s].
        wall_time: time it took [s].
        brakes: updates in which the controller braked the robot.
        late: periods that a real-time loop overran.
        contacts: forbidden contacts that began.
        contact_periods: control periods with a forbidden contact.
        smallest_distance: smallest signed distance, tool against work surfaces left out [m].
        spent: where the wall time went, by part of the loop [s].
        started: Unix time at its beginning [s].
    """

    seed: int
    success: bool
    failure_reason: str
    frames: int
    seconds: float
    wall_time: float
    brakes: int
    late: int
    contacts: int
    contact_periods: int
    smallest_distance: float
    spent: Mapping[str, float]
    started: float


class Observer(Protocol):
    """Something that watches a session: a recorder, a display."""

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note that an episode begins."""
        ...

    def see(self, frame: Frame) -> None:
        """Take one moment."""
        ...


class Disturbance(Protocol):
    """Something from outside that acts on the robot: pushes."""

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note that an episode begins."""
        ...

    def act(self, simulation: Simulation) -> None:
        """Act during the control period that begins now."""
        ...


class Session:
    """Runs episodes.

    Args:
        env: a Handrail environment.
        controller: completes the intent.
        operator: whoever steers.
        observers: shown every moment.
        realtime: pace the loop by the wall clock.
        disturbances: what acts on the robot from outside.
    """

    def __init__(
        self,
        env: HandrailEnv,
        controller: Controller,
        operator: Operator,
        observers: Sequence[Observer] = (),
        realtime: bool = False,
        disturbances: Sequence[Disturbance] = (),
    ) -> None:
        self.env = env
        self._controller = controller
        self._operator = operator
        self._observers = observers
        self._realtime = realtime
        self._disturbances = disturbances

    @property
    def model(self) -> RobotModel:
        """The robot's model."""
        return self.env.model

    def run(self, seed: int) -> Outcome:
        """Run one episode and return how it went; the same seed gives the same episode."""
        with single_threaded():
            return self._run(seed)

    def _run(self, seed: int) -> Outcome:
        observation, info = self.env.reset(seed=seed)
        around = _Surroundings(self.env, self._controller)
        self._operator.reset(self._view(observation), np.random.default_rng([seed, 1]))
        for other in (*self._observers, *self._disturbances):
            other.begin(self.env, seed)
        tally = _Tally(seed, 1.0 / self.env.fps)
        done = False
        while not done:
            wall_clock = tally.elapsed
            with tally.timed("operator"):
                intent = self._operator.act(self._view(observation))
            with tally.timed("controller"):
                around.observe()
                command = self._controller.update(self.env.state(), intent)
            action = action_of(command, 1.0 / self.env.fps)
            with tally.timed("environment"):
                for disturbance in self._disturbances:
                    disturbance.act(self.env.simulation)
                following, _, terminated, truncated, info = self.env.step(action)
            done = terminated or truncated
            frame = Frame(
                state=observation["agent_pos"],
                environment=observation["environment_state"],
                images=observation.get("pixels", {}),
                intent=intent,
                action=info["sent"],
                command=action,
                diagnostics=command.diagnostics,
                contacts=info["contacts"],
                success=bool(info["is_success"]),
                done=done,
                wall_clock=wall_clock,
            )
            with tally.timed("observers"):
                for observer in self._observers:
                    observer.see(frame)
            tally.add(frame)
            observation = following
            if self._realtime:
                tally.pace()
        return tally.outcome(info)

    def _view(self, observation: Mapping[str, Any]) -> View:
        task = self.env.task_state()
        return View(self.env.state(), task.tool, task.opening, task, observation)


def action_of(command: Command, period: float) -> np.ndarray:
    """Return the env's action: velocity at the end of the period and gripper, (n + 1,) float32."""
    return np.append(command.velocity(period), command.gripper).astype(np.float32)


class _Surroundings:
    """Tells a controller what there is to avoid: at the beginning, and while it moves or is held."""

    def __init__(self, env: HandrailEnv, controller: Controller) -> None:
        self._env, self._controller = env, controller
        self._moving, self._holding = bool(env.episode.scene.movers), bool(env.simulation.held())
        controller.reset(env.obstacles())

    def observe(self) -> None:
        """Say where things are now, if that can have changed."""
        before, self._holding = self._holding, bool(self._env.simulation.held())
        if self._moving or self._holding or before:
            self._controller.update_scene(self._env.obstacles())


class _Tally:
    """Counts along an episode and keeps its pace."""

    def __init__(self, seed: int, period: float) -> None:
        self._seed = seed
        self._period = period
        self._started = time.time()
        self._start = time.perf_counter()
        self._frames = self._brakes = self._late = 0
        self._contacts: list[int] = []
        self._smallest = np.inf
        self._spent: dict[str, float] = {}

    @property
    def elapsed(self) -> float:
        """Wall time since the episode began [s]."""
        return time.perf_counter() - self._start

    @contextlib.contextmanager
    def timed(self, part: str) -> Iterator[None]:
        """Add the time of a block to a part of the loop."""
        start = time.perf_counter()
        yield
        self._spent[part] = self._spent.get(part, 0.0) + time.perf_counter() - start

    def add(self, frame: Frame) -> None:
        self._frames += 1
        self._brakes += Status(frame.diagnostics.status).brakes
        self._contacts.append(frame.contacts)
        self._smallest = min(self._smallest, frame.diagnostics.smallest_distance)

    def pace(self) -> None:
        """Wait for the end of the period, or note that it is over."""
        ahead = self._start + self._frames * self._period - time.perf_counter()
        if ahead > 0:
            time.sleep(ahead)
        else:
            self._late += 1

    def outcome(self, info: dict) -> Outcome:
        return Outcome(
            seed=self._seed,
            success=bool(info["is_success"]),
            failure_reason=str(info["failure_reason"]),
            frames=self._frames,
            seconds=self._frames * self._period,
            wall_time=self.elapsed,
            brakes=self._brakes,
            late=self._late,
            contacts=int(contacts_begun(self._contacts)),
            contact_periods=int(np.count_nonzero(self._contacts)),
            smallest_distance=float(self._smallest),
            spent=dict(self._spent),
            started=self._started,
        )
