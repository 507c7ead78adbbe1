"""Sizes of policies that suit a CPU or a GPU, and LeRobot's configuration of a policy."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

from handrail.controllers.errors import HandrailError, message_of, unknown_name
from handrail.datasets.storage.strict_json import parse_json
from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.interface.trust import registered_policies
from handrail.policies.imitation.training.refusal import in_one_line

if TYPE_CHECKING:
    from lerobot.configs.policies import PreTrainedConfig


@dataclass(frozen=True)
class Preset:
    """Sizes of a policy and of its training."""

    options: Mapping[str, Any] = field(default_factory=dict)
    """Of the policy, as LeRobot calls them."""
    lr: float = 1e-4
    """Highest learning rate."""
    cosine: bool = False
    """Whether the learning rate falls along a cosine; else as the policy has it."""
    steps: int = 100_000
    """Updates."""
    batch_size: int = 64
    """Samples an update."""


_ENSEMBLE = "temporal_ensemble_coeff"
ACT_CPU: dict[str, Any] = {
    "chunk_size": 20,
    "n_action_steps": 1,
    _ENSEMBLE: 0.01,  # averaging over overlapping chunks: 90 % instead of 65 % on pick_place
    "dim_model": 128,
    "n_heads": 4,
    "dim_feedforward": 512,
    "n_encoder_layers": 2,
    "use_vae": False,
    "dropout": 0.0,  # as good on reach as 0.1 (98 and 96 %), a third of the time less
}
_DIFFUSION: dict[str, Any] = {"noise_scheduler_type": "DDIM", "num_inference_steps": 10}
_DIFFUSION_CPU = _DIFFUSION | {"horizon": 16, "n_action_steps": 8, "down_dims": [64, 128, 256]}
_DIFFUSION_GPU = _DIFFUSION | {"horizon": 32, "n_action_steps": 16, "drop_n_last_frames": 15}
_PRESETS = {
    ("act", "cpu"): Preset(ACT_CPU, lr=5e-4, cosine=True, steps=10_000, batch_size=32),
    ("act", "gpu"): Preset({"chunk_size": 50, "n_action_steps": 25}, lr=5e-5, cosine=True),
    ("diffusion", "cpu"): Preset(_DIFFUSION_CPU, lr=3e-4, steps=10_000),
    ("diffusion", "gpu"): Preset(_DIFFUSION_GPU, lr=1e-4),
}


def resolved(config: TrainConfig) -> Preset:
    """Return what a training really uses: the preset, and over it what the config says.

    A policy without a preset is trained as LeRobot has it.
    """
    preset = _PRESETS.get((config.policy, config.preset), Preset(lr=0.0))
    options, given = dict(preset.options), {key: _value(text) for key, text in config.options().items()}
    if "n_action_steps" in given:
        options.pop(_ENSEMBLE, None)  # averaging is for a look at every step
    return replace(
        preset,
        options=options | given,
        lr=config.lr or preset.lr,
        steps=config.steps or preset.steps,
        batch_size=config.batch_size or preset.batch_size,
    )


def device_of(config: TrainConfig) -> str:
    """Return where to train."""
    import torch

    device = config.device or ("cuda" if config.preset == "gpu" else "cpu")
    available = {"cpu": True, "cuda": torch.cuda.is_available(), "mps": torch.backends.mps.is_available()}
    if not available.get(device.partition(":")[0], False):
        raise unknown_name("device", device, [name for name, here in available.items() if here])
    return device


def policy_config(config: TrainConfig) -> "PreTrainedConfig":
    """Return LeRobot's configuration of the policy: preset, then `lr`, then `policy_options`.

    The environment's state is normalised like the robot's, nothing is downloaded, nothing is sent anywhere.
    """
    import draccus

    choices, sizes = registered_policies(), resolved(config)
    if config.policy not in choices:
        raise unknown_name("policy", config.policy, choices)
    known = {entry.name for entry in fields(choices[config.policy])}
    if config.lr and "optimizer_lr" not in known:
        raise HandrailError(f"--lr: the policy {config.policy} has none; give its own with --policy_options")
    for key in sizes.options:
        if key not in known:
            raise unknown_name(f"setting of the policy {config.policy}", key, known)
    wanted = {"pretrained_backbone_weights": None, "push_to_hub": False, "device": device_of(config)}
    wanted |= {"optimizer_lr": sizes.lr, "optimizer_lr_backbone": sizes.lr} if sizes.lr else {}
    settings = {key: value for key, value in wanted.items() if key in known} | dict(sizes.options)
    try:
        policy: Any = draccus.decode(choices[config.policy], settings)
    # LeRobot's ACT raises NotImplementedError at averaging with more than one action a look
    except (draccus.utils.ParsingError, ValueError, TypeError, NotImplementedError) as error:
        cause = error if isinstance(error, draccus.utils.DecodingError) else error.__cause__ or error
        raise HandrailError(f"policy {config.policy}: {message_of(cause)}") from error
    mapping = policy.normalization_mapping
    if "STATE" in mapping and "ENV" not in mapping:
        policy.normalization_mapping = mapping | {"ENV": mapping["STATE"]}
    return policy


def check_policy(config: TrainConfig) -> None:
    """Build a policy once, for made-up inputs, so that what it refuses is known before there is data.

    Only its settings are checked where Handrail has no sizes for it: such a policy may load something.
    """
    described = policy_config(config)
    if (config.policy, config.preset) not in _PRESETS:
        return
    from lerobot.configs.types import FeatureType, PolicyFeature
    from lerobot.policies.factory import get_policy_class

    described.input_features = {
        "observation.state": PolicyFeature(FeatureType.STATE, (2,)),
        "observation.environment_state": PolicyFeature(FeatureType.ENV, (2,)),
    }
    described.output_features = {"action": PolicyFeature(FeatureType.ACTION, (2,))}
    with in_one_line(config):
        get_policy_class(config.policy)(described)


def _value(text: str) -> Any:
    try:
        return parse_json(text.encode())
    except ValueError:
        return None if text in ("None", "none") else {"True": True, "False": False}.get(text, text)
