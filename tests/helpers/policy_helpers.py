"""Shared by the tests of evaluation: checkpoint folders of policies that nobody trained."""

import os
import signal
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_env
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.model import load_model
from handrail.policies.imitation.interface.checkpoint import PolicyMeta, read_meta, write_meta
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.trust import PROCESSORS

HOLD = 15  # periods for which a random policy keeps to what it drew


class StandIn:
    """Sees and acts as a trained policy does; `kind` says how."""

    encoder = None

    def __init__(self, interface: PolicyInterface, kind: str) -> None:
        self.interface = interface
        self._kind = kind
        self.reset()

    def reset(self) -> None:
        self._steps = 0
        self._rng = np.random.default_rng(0)

    def act(self, state, environment, images, task):
        self._steps += 1
        return np.asarray(getattr(self, f"_{self._kind}")(state, environment), np.float32)

    def _chase(self, state, environment):
        """Steer the hand straight to the goal; as joint velocities, by damped least squares."""
        seen = dict(zip(self.interface.observation_names[1], environment, strict=True))
        way = np.array([seen[f"goal.{axis}"] for axis in ("dx", "dy", "dz")])
        matrix = [[seen[f"goal.r{row}{column}"] for column in range(3)] for row in range(3)]
        turn = Rotation.from_matrix(matrix).as_rotvec()
        twist = np.clip(np.concatenate([1.5 * way, 1.5 * turn]), -0.4, 0.4)
        if self.interface.actions == "intent":
            return np.append(twist, 0.0)
        jacobian = load_model().jacobian(np.concatenate([np.zeros(3), state[:6]]))
        velocity = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + 0.01 * np.eye(6), twist)
        return np.append(velocity, 0.0)

    def _random(self, state, environment):
        """Draw something bold, and keep to it for a while."""
        if self._steps % HOLD == 1:
            self._drawn = self._rng.uniform(-1.0, 1.0, len(self.interface.action_names))
        return self._drawn

    def _torch(self, state, environment):
        """Draw as a diffusion policy does."""
        import torch

        return 0.3 * torch.randn(len(self.interface.action_names)).numpy()

    def _still(self, state, environment):
        return np.zeros(len(self.interface.action_names))

    def _nan(self, state, environment):
        """Chase, but for every fifth action."""
        action = self._chase(state, environment)
        if self._steps % 5 == 0:
            action[self._steps % len(action)] = np.nan
        return action

    def _short(self, state, environment):
        return np.zeros(3)


def load(folder: Path) -> StandIn:
    kind = (folder / "kind").read_text()
    if kind == "torch":
        import torch  # noqa: F401  (as a trained policy does)
    return StandIn(read_meta(folder).interface, kind)


def checkpoint(
    folder: Path, kind="chase", task="reach", mode="ee", actions="intent", training_seed=0, time_limit=0.0
) -> Path:
    """Write a checkpoint folder of a stand-in."""
    env = build_env(SessionConfig(task=task), 20)
    channels = Channels.of(env.model.description)
    focuses = ("base", "hand")
    groups = [MODES[mode].owned(focus) for focus in focuses]
    if mode == "direct_single":  # one axis at a time
        groups = [(name,) for name in (*channels.base, *channels.joints[3:])]
    masks = {tuple(channels.mask(*names).tolist()) for names in groups}
    owned = tuple(sorted(masks)) if actions == "intent" else ()
    interface = PolicyInterface(actions, env.agent_names, env.state_names, channels.names, owned, True)
    trained_on = {"episodes": 50, "operator_time": 312.5}
    what = (interface, task, mode, "ridgeback_ur10", 20, actions, training_seed, 0, trained_on, "act", 100)
    meta = PolicyMeta(*what, time_limit=time_limit)
    env.close()
    folder.mkdir(parents=True)
    write_meta(folder, meta)
    (folder / "config.json").write_text('{"type": "act"}')
    for name in PROCESSORS:
        (folder / name).write_text('{"steps": []}')
    (folder / "model.safetensors").touch()
    (folder / "kind").write_text(kind)
    return folder


def untrained_act(folder, actions):
    """Write a small ACT that nobody trained."""
    import torch
    from lerobot.configs.types import FeatureType, PolicyFeature
    from lerobot.policies.act.configuration_act import ACTConfig
    from lerobot.policies.act.modeling_act import ACTPolicy
    from lerobot.policies.factory import make_pre_post_processors

    env = build_env(SessionConfig(task="reach"), 20)
    channels = Channels.of(env.model.description)
    masks = (tuple(channels.mask("ee").tolist()),) if actions == "intent" else ()
    space = "realised" if actions == "recorded" else actions
    interface = PolicyInterface(space, env.agent_names, env.state_names, channels.names, masks)
    env.close()
    state, environment = map(len, interface.observation_names)
    written = len(interface.action_names)
    if actions == "recorded":
        state, environment, written = len(env.agent_names), len(env.state_names), len(channels.joints) + 1
    config = ACTConfig(
        input_features={
            "observation.state": PolicyFeature(FeatureType.STATE, (state,)),
            "observation.environment_state": PolicyFeature(FeatureType.ENV, (environment,)),
        },
        output_features={"action": PolicyFeature(FeatureType.ACTION, (written,))},
        dim_model=32,
        dim_feedforward=32,
        n_heads=2,
        chunk_size=5,
        n_action_steps=5,
        use_vae=False,
        device="cpu",
        push_to_hub=False,
        pretrained_backbone_weights=None,
    )
    with torch.random.fork_rng():
        torch.manual_seed(0)  # others, with ill luck, drive into something
        ACTPolicy(config).save_pretrained(folder)
    for processor in make_pre_post_processors(config):
        processor.save_pretrained(folder)
    said = None if actions == "recorded" else interface
    meta = PolicyMeta(said, "reach", "ee", "ridgeback_ur10", 20, actions, 0, 0, {"episodes": 1}, "act", 0)
    write_meta(folder, meta)
    return str(folder)


def unable(path):
    """Load a policy, but for one that cannot be loaded."""
    if path.name == "broken":
        raise HandrailError("broken: no weights")
    return StandIn(load(path).interface, "still")


def killed(path):
    """Load a policy in a process that is then killed, as one that wants too much memory is."""
    os.kill(os.getpid(), signal.SIGKILL)
