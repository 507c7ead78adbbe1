"""The policy whose weights a training begins with: it has to read and write what is learnt now."""

from dataclasses import replace
from pathlib import Path

from lerobot.configs.policies import PreTrainedConfig

from handrail.controllers.errors import HandrailError, shown
from handrail.datasets.recording.frames import PICTURE
from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.interface.checkpoint import PolicyMeta, model_folder, read_meta
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.trust import check_policy_folder
from handrail.policies.imitation.training.presets import policy_config


def earlier_policy(config: TrainConfig) -> tuple[Path, PolicyMeta]:
    """Return the folder of the policy that `init` names, and what it is, once it is sure to do no harm."""
    place = model_folder(Path(config.init).expanduser())
    if config.folder.resolve() in place.resolve().parents:
        raise HandrailError(f"--init {config.init}: expected a policy outside --output")
    earlier = read_meta(place)
    for name in ("policy", "actions"):
        said, wanted = getattr(earlier, name), getattr(config, name)
        if said != wanted:
            raise HandrailError(f"--init {config.init}: expected a policy with {name} {wanted}, got {said}")
    if bool(earlier.cameras) != bool(config.encoder):
        words = "with" if config.encoder else "without"
        raise HandrailError(f"--init {config.init}: expected a policy {words} an --encoder")
    check_policy_folder(place, asked=[policy_config(config)])
    return place, earlier


def check_pictures(place: Path, config: PreTrainedConfig) -> None:
    """Check that a policy sees the pictures of a config: of the same cameras in the same order and size."""
    saw, sees = (
        ", ".join(f"{name.removeprefix(PICTURE)} {list(each.shape)}" for name, each in features.items())
        for features in (PreTrainedConfig.from_pretrained(place).image_features, config.image_features)
    )
    if saw != sees:
        raise HandrailError(
            f"policy {str(place)!r}: expected one that sees {sees or 'nothing'}, got {saw or 'nothing'}"
        )


def same_interface(init: str, earlier: PolicyMeta, interface: PolicyInterface) -> PolicyInterface:
    """Return the interface of the policy that a training begins with, once it is the dataset's.

    It may have more masks than the dataset, none fewer: what nobody owns is no mask to learn.
    """
    known = earlier.interface
    assert known is not None
    refused = f"--init {init}: expected a policy of the dataset's"
    for name in ("state_names", "environment_names", "channels", "base_pose"):
        if getattr(known, name) != getattr(interface, name):
            raise HandrailError(f"{refused} {name.replace('_', ' ')}, got {shown(getattr(known, name))}")
    if new := [mask for mask in interface.masks if mask not in known.masks]:
        names = [name for name, owned in zip(interface.channels, new[0], strict=True) if owned]
        raise HandrailError(f"{refused} masks; it has none of {', '.join(names)}")
    return replace(interface, masks=known.masks)
