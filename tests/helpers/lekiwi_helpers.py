"""A LeKiwi behind a client in this process: simulated, in time that passes only when somebody sleeps."""

from typing import Any

from processor_helpers import Clock

from handrail.collect.envs.env import HandrailEnv
from handrail.collect.lekiwi.body import LeKiwiBody
from handrail.collect.lekiwi.host_loop import SEED
from handrail.collect.processor.units import robot_units
from handrail.collect.tasks.reach import Reach

ZERO = ("x.vel", "y.vel", "theta.vel")


class PlayedClient:
    """Answers as LeRobot's LeKiwiClient does: while nothing new comes, with the very same object again.

    Attributes:
        silent: when it says nothing, from and to [s].
        sent: every action.
    """

    def __init__(
        self, silent: tuple[float, float] = (0.0, 0.0), cameras: dict[str, Any] | None = None
    ) -> None:
        self.clock, self.silent, self.cameras = Clock(), silent, cameras or {}
        env = HandrailEnv(Reach(), "lekiwi", fps=60, observes=False)
        self.body = LeKiwiBody(env, robot_units("lekiwi", env.model.description))
        self.sent: list[dict[str, Any]] = []
        self.connected, self.stubborn, self.leap = False, False, 0.0
        self.last, self.said_at, self.began, self.seed = {}, -1.0, self.clock.now, None
        self.body.reset(0)

    @property
    def action_features(self) -> dict[str, type]:
        return dict.fromkeys(self.body.observation(), float)

    def connect(self) -> None:
        self.connected = True

    def disconnect(self) -> None:
        self.connected = False

    def sleep(self, seconds: float) -> None:
        self.clock.now += seconds

    def send_action(self, action: dict[str, Any]) -> None:
        self.sent.append(action)
        if action.get(SEED, self.seed) != self.seed:
            self.seed, self.began = action[SEED], self.clock.now
            self.body.reset(int(action[SEED]))
        if not self.stubborn:
            assert self.body.take(action)

    def get_observation(self) -> dict[str, Any]:
        now = self.clock.now - 100.0
        if self.clock.now > self.said_at and not self.silent[0] <= now < self.silent[1]:
            self.body.advance(self.clock.now - self.began)
            self.last, self.said_at = {**self.body.observation(), **self.cameras}, self.clock.now
        return self.last
