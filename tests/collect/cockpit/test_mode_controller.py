"""Laws: a mode can change while the robot moves, and what is sent stays within the limits of acceleration."""

from functools import partial

import numpy as np
import pytest

from handrail.collect.config import SessionConfig
from handrail.collect.session.build import build_controller, build_env, build_modes
from handrail.collect.session.mode_controller import ModeController
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.intent import Intent

PERIOD = 0.05


@pytest.fixture(scope="module")
def env():
    made = build_env(SessionConfig(task="reach", physics=False), 20)
    made.reset(seed=0)
    return made


def test_no_change_of_mode_jolts(env):
    model = env.model
    modes = build_modes(SessionConfig(task="reach", physics=False), env)
    build = partial(build_controller, fps=20, task="reach")
    controller = ModeController(modes, build, modes["ee"], model)
    channels, limits = Channels.of(model.description), model.description.limits
    rng = np.random.default_rng(0)
    controller.reset(env.obstacles())
    names, before, fastest = list(modes), np.zeros(model.size), 0.0
    for step in range(66):
        mode = modes[names[step // 3 % len(names)]]
        mask = channels.mask(*mode.owned("hand"))
        values = np.where(mask, rng.uniform(-0.3, 0.3, channels.size), 0.0)
        state = env.state()
        command = controller.update(state, Intent(values, mask, mode=mode.name, time=state.time))
        v = command.velocity(PERIOD)
        assert np.all(np.abs(v - before) <= limits.acceleration * PERIOD * (1 + 1e-6))
        before, fastest = v, max(fastest, float(np.abs(v).max()))
        env.plant.send(np.append(v, 0.0))
    assert fastest > 0.1


def test_a_mask_of_no_size_brakes(env):
    config = SessionConfig(task="reach", physics=False)
    modes, build = build_modes(config, env), partial(build_controller, fps=20, task="reach")
    controller = ModeController(modes, build, modes["ee"], env.model)
    controller.reset(env.obstacles())
    command = controller.update(env.state(), Intent(0.0, True, mode="direct", time=env.state().time))
    assert command.diagnostics.status == Status.INVALID_INTENT
