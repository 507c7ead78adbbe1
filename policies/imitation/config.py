"""Settings of imitation training; light to import."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta

from handrail.collect.config import StoredConfig
from handrail.controllers.errors import HandrailError, check_installed
from handrail.controllers.typed import AtLeastOne, Count, NonNegative, check_settings
from handrail.datasets.advanced import Advanced
from handrail.datasets.lists import Words

FREE_ON_RESUME = (
    *("output", "save_freq", "threads", "device", "resume", "overwrite", "steps", "dataset", "verify"),
)
_OF_POLICY = {"diffusion": ("diffusers",)}


@dataclass(frozen=True)
class TrainConfig:
    """Train an imitation policy with LeRobot's own training, on a dataset or a part of it."""

    dataset: StoredConfig = field(default_factory=StoredConfig)
    output: str = "outputs/policy"
    """Folder for checkpoints and the curve of the loss."""
    policy: str = "act"
    """A policy that LeRobot has registered: act, diffusion, vqbet, …"""
    preset: Literal["cpu", "gpu"] = "cpu"
    """Sizes that learn from the state on two CPU cores, or larger ones for a GPU and images."""
    actions: Literal["realised", "intent", "recorded"] = "realised"
    """The policy's outputs: the joint velocities that came about; the operator's own command, which the
    controller completes when the policy drives; or `recorded`, all columns as they are in any dataset."""
    base_pose: Advanced[bool] = True
    """Let the policy see where the base is, as operators do who plan where to stand."""
    images: bool = False
    """Let the policy see the cameras too."""
    encoder: str = ""
    """Let an encoder say from the pictures where things are: its name, or a file of handrail-encoder."""
    scene: Advanced[bool] = True
    """Let the policy see where things are; with --no_scene it has to find them in the pictures."""
    mode: str = ""
    """Only episodes of this teleop mode."""
    success_only: bool = False
    """Only episodes that succeeded, as the task's judge says; where there is none, as the operator says."""
    episodes: Count = 0
    """Only so many of them, drawn at random; 0 for all."""
    minutes: Advanced[NonNegative] = 0.0
    """Only what fits into so much of the operator's time, failed attempts included [min]; 0 for all."""
    draw: Advanced[Count] = 0
    """Seed of the order in which episodes are drawn; more episodes or minutes only add to the fewer."""
    corrections: Literal["all", "only", "weighted"] = "all"
    """Where a person took over from a policy: learn from all frames, only from those that a person commanded,
    or from all with the corrections drawn as often as everything else together."""
    init: str = ""
    """Begin with the weights of an earlier policy, from its folder; it has to read and write the same."""
    steps: Count = 0
    """Updates of the policy; 0 for the preset's."""
    eval_split: Advanced[Annotated[float, Meta(ge=0, lt=1)]] = 0.0
    """Share of the episodes that the policy does not learn from, 5 at least: the loss is measured on them."""
    eval_steps: Advanced[AtLeastOne] = 500
    """Updates between two such measurements."""
    batch_size: Advanced[Count] = 0
    """Samples an update; 0 for the preset's."""
    lr: Advanced[NonNegative] = 0.0
    """Highest learning rate; 0 for the preset's."""
    seed: Count = 0
    """Seed of the policy's first weights and the order of the samples."""
    threads: Advanced[AtLeastOne] = 1
    """PyTorch's; two trainings with one thread each are faster than one after the other with two."""
    device: str = ""
    """Device: cpu, cuda, cuda:1, mps; the preset's when empty."""
    save_freq: Advanced[AtLeastOne] = 2000
    """Updates between checkpoints; there is always one at the end."""
    policy_options: Advanced[Words] = ()
    """More of LeRobot's settings of the policy, `key=value` each: chunk_size=50 use_vae=true."""
    resume: bool = False
    """Go on from the last checkpoint in the folder; begin if there is none."""
    overwrite: Advanced[bool] = False
    """Remove the training that is there."""
    verify: Advanced[bool] = False
    """Read every file of the dataset anew, not only those that have changed since they were checked."""

    @property
    def folder(self) -> Path:
        """The folder of the training."""
        return Path(self.output).expanduser()

    def check(self) -> None:
        """Check what can be checked without reading the dataset."""
        check_settings(self, "--")
        if not self.scene and not self.images:
            raise HandrailError("--no_scene: expected --images too, else the policy sees nothing of its task")
        if self.encoder and (self.images or not self.scene or self.actions == "recorded"):
            words = "expected neither --images nor --no_scene nor --actions recorded beside it"
            raise HandrailError(f"--encoder: {words}; it takes the place of where things are")
        if self.resume and self.overwrite:
            raise HandrailError("--resume and --overwrite: expected one of them, got both")
        self.options()
        _ = self.dataset.folder

    def options(self) -> dict[str, str]:
        """Return `policy_options` by key."""
        pairs = [option.partition("=") for option in self.policy_options]
        for option, (key, sign, _) in zip(self.policy_options, pairs, strict=True):
            if not key.strip() or not sign:
                raise HandrailError(f"--policy_options {option}: expected key=value, as in chunk_size=50")
        return {key.strip(): value.strip() for key, _, value in pairs}


def check_trainable(command: str, policy: str) -> None:
    """Check that a command has what trains a policy, by its name in LeRobot."""
    check_installed(command, ("torch", "accelerate", *_OF_POLICY.get(policy, ())), "train")
