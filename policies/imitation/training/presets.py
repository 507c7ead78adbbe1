"""Sizes of policies that suit a CPU or a GPU, and LeRobot's configuration of a policy; both as they began."""

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

from safetensors import SafetensorError

from handrail.controllers.errors import HandrailError, check_known, message_of
from handrail.datasets.storage.strict_json import parse_json
from handrail.policies.imitation.config import FREE_ON_RESUME, TrainConfig
from handrail.policies.imitation.interface.checkpoint import PolicyMeta, TrainingSizes, as_json
from handrail.policies.imitation.interface.trust import registered_policies

if TYPE_CHECKING:
    from lerobot.configs.policies import PreTrainedConfig


_REFUSALS = (ValueError, TypeError, AssertionError, ImportError, RuntimeError, LookupError, SafetensorError)
_SINCE = {"corrections": "all", "init": ""}  # settings of which older checkpoints do not say, and did so
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
    ("act", "cpu"): TrainingSizes(ACT_CPU, lr=5e-4, cosine=True, steps=10_000, batch_size=32),
    ("act", "gpu"): TrainingSizes({"chunk_size": 50, "n_action_steps": 25}, lr=5e-5, cosine=True),
    ("diffusion", "cpu"): TrainingSizes(_DIFFUSION_CPU, lr=3e-4, steps=10_000),
    ("diffusion", "gpu"): TrainingSizes(_DIFFUSION_GPU, lr=1e-4),
}


def resolved(config: TrainConfig) -> TrainingSizes:
    """Return what a training really uses: the preset, and over it what the config says.

    A policy without a preset is trained as LeRobot has it.
    """
    preset = _PRESETS.get((config.policy, config.preset), TrainingSizes(lr=0.0))
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


def policy_config(config: TrainConfig) -> "PreTrainedConfig":
    """Return LeRobot's configuration of the policy: preset, then `lr`, then `policy_options`.

    The environment's state is normalised like the robot's, nothing is downloaded, nothing is sent anywhere.
    """
    import draccus

    from handrail.policies.imitation.interface.compute import device_of

    choices, sizes = registered_policies(), resolved(config)
    check_known("policy", (config.policy,), choices)
    known = {entry.name for entry in fields(choices[config.policy])}
    if config.lr and "optimizer_lr" not in known:
        raise HandrailError(f"--lr: the policy {config.policy} has none; give its own with --policy_options")
    check_known(f"setting of the policy {config.policy}", sizes.options, known)
    device = device_of(config.device or ("cuda" if config.preset == "gpu" else "cpu"))
    wanted = {"pretrained_backbone_weights": None, "push_to_hub": False, "device": device}
    wanted |= {"optimizer_lr": sizes.lr, "optimizer_lr_backbone": sizes.lr} if sizes.lr else {}
    settings = {key: value for key, value in wanted.items() if key in known} | dict(sizes.options)
    try:
        policy: Any = draccus.decode(choices[config.policy], settings)
    except (draccus.utils.ParsingError, ValueError, TypeError, RuntimeError) as error:  # policies' own
        cause = error if isinstance(error, draccus.utils.DecodingError) else error.__cause__ or error
        raise HandrailError(f"policy {config.policy}: {message_of(cause)}") from error
    mapping = policy.normalization_mapping
    if "STATE" in mapping and "ENV" not in mapping:
        policy.normalization_mapping = mapping | {"ENV": mapping["STATE"]}
    return policy


@contextmanager
def in_one_line(config: TrainConfig) -> Iterator[None]:
    """Turn what is raised while a policy is built or trained into one line."""
    try:
        yield
    except OSError as error:
        raise HandrailError(f"training in {config.output}: {message_of(error)}") from error
    except _REFUSALS as error:
        frames = traceback.walk_tb(error.__traceback__)
        names = [str(frame.f_globals.get("__name__")).partition(".")[0] for frame, _ in frames]
        known = [name for name in names if name in ("handrail", "lerobot", "accelerate")]
        if known[-1:] in ([], ["handrail"]):  # neither LeRobot nor accelerate, nor what they called
            raise
        raise HandrailError(f"policy {config.policy}: {message_of(error)}") from error


def check_settings(config: TrainConfig, began: PolicyMeta) -> None:
    """Check that settings are those of a checkpoint, and its sizes still those of the preset."""
    sizes, least = resolved(config), began.sizes.steps
    if config.steps and sizes.steps < least:
        raise HandrailError(f"--resume with --steps {sizes.steps}: expected {least} or more, as it began")
    now = {f"--{name}": value for name, value in as_json(config).items() if name not in FREE_ON_RESUME}
    then = {f"--{name}": value for name, value in (_SINCE | dict(began.training)).items()}
    for each, found in ((sizes, now), (began.sizes, then)):
        found |= {f"the preset's {name}": getattr(each, name) for name in ("lr", "cosine", "batch_size")}
        found |= {f"the policy's {name}": value for name, value in sorted(as_json(each)["options"].items())}
    options = [name for name in then if name.startswith("the policy's ")]
    for name in dict.fromkeys((*now, *options)):
        if now.get(name) != then.get(name):
            words = f"expected {then.get(name)} as the training began"
            raise HandrailError(f"--resume with {name} {now.get(name)}: {words}")


def _value(text: str) -> Any:
    try:
        return parse_json(text.encode())
    except ValueError:
        return None if text in ("None", "none") else {"True": True, "False": False}.get(text, text)
