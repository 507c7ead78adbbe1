"""A trained policy that drives; its numbers, and what PyTorch holds meanwhile."""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import draccus
import numpy as np
import torch
from lerobot.configs import FeatureType, NormalizationMode
from lerobot.policies.factory import get_policy_class, make_pre_post_processors
from lerobot.processor import NormalizerProcessorStep, UnnormalizerProcessorStep
from safetensors.torch import load_model

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError, restated
from handrail.datasets.recording.frames import PICTURE
from handrail.policies.imitation.interface.checkpoint import NAME, PolicyMeta, model_folder, read_meta
from handrail.policies.imitation.interface.encoder import Encoder
from handrail.policies.imitation.interface.encoder_step import encoder_of
from handrail.policies.imitation.interface.interface import ACTION, ENVIRONMENT, STATE
from handrail.policies.imitation.interface.steps import without_steps
from handrail.policies.imitation.interface.trust import WEIGHTS, check_policy_folder, registered_policies

_FETCHED = "pretrained_backbone_weights"


@dataclass(frozen=True)
class TrainedPolicy:
    """A policy that can drive."""

    meta: PolicyMeta | None
    """Its description; None for a policy of plain LeRobot."""
    policy: Any
    """LeRobot's."""
    before: Callable[[dict[str, Any]], dict[str, Any]]
    """LeRobot's preprocessor: normalises."""
    after: Callable[[Any], Any]
    """LeRobot's postprocessor: the reverse."""
    encoder: Encoder | None = None
    """Reads for it from pictures where things are."""

    def reset(self) -> None:
        """Forget the last episode."""
        self.policy.reset()

    def act(
        self,
        state: FloatArray,
        environment: FloatArray | None = None,
        images: Mapping[str, np.ndarray] | None = None,
        task: str = "",
    ) -> FloatArray:
        """Return the next action, (a,) float32.

        Args:
            state: as the interface observes it, (s',).
            environment: the same, (e',); None or empty if there is none.
            images: pictures by camera, (height, width, 3) uint8 each.
            task: one sentence: what to do; for policies that read it.
        """
        batch: dict[str, Any] = {
            key: torch.from_numpy(np.asarray(values, np.float32))[None]
            for key, values in zip((STATE, ENVIRONMENT), (state, environment), strict=True)
            if key in self.policy.config.input_features and values is not None and np.size(values)
        }
        for camera, picture in (images or {}).items():
            pixels = torch.from_numpy(np.ascontiguousarray(picture)).permute(2, 0, 1)
            batch[PICTURE + camera] = pixels[None].float() / 255.0
        batch["task"] = [task]
        with self._restated(), torch.inference_mode():
            return self.after(self.policy.select_action(self.before(batch)))[0].cpu().numpy()

    def planned(self) -> FloatArray:
        """Return the actions that are planned beyond the last one, (K, a) float32; none of other kinds."""
        rows = list(self._queue)
        with self._restated(), torch.inference_mode():
            return self.after(torch.cat(rows)).cpu().numpy() if rows else np.zeros((0, 0), np.float32)

    def skip(self, count: int) -> None:
        """Leave out so many planned actions: their time is over; an average over plans begins anew."""
        if ensembler := getattr(self.policy, "temporal_ensembler", None):
            ensembler.reset()
        for _ in range(min(count, len(self._queue))):
            self._queue.popleft()

    def _restated(self) -> AbstractContextManager[None]:
        return restated(f"policy {self.policy.config.type}: cannot act")  # of LeRobot and all below it

    @property
    def _queue(self) -> deque[Any]:
        """What LeRobot's policy has planned: ACT and Diffusion keep it in one of two places."""
        queues = getattr(self.policy, "_queues", None) or {}
        return getattr(self.policy, "_action_queue", queues.get(ACTION, deque()))


def load_policy(folder: str | Path) -> TrainedPolicy:
    """Load a policy from a `pretrained_model` folder, a checkpoint, or a training's folder (the last one).

    It computes on the CPU. Loading it never runs code of its maker's (`trust.py`).
    """
    place = model_folder(Path(folder).expanduser())
    meta = read_meta(place) if (place / NAME).is_file() else None
    settings = check_policy_folder(place)
    kind, override = settings.pop("type"), {"device_processor": {"device": "cpu"}}
    if _FETCHED in settings:  # PyTorch would fetch these first; the checkpoint has others
        settings[_FETCHED] = None
    with restated(f"policy {str(place)!r}"):  # LeRobot's and all below it: what the files hold is refused
        config = draccus.decode(registered_policies()[kind], settings | {"device": "cpu"})
        policy = get_policy_class(kind).from_pretrained(place, config=config, strict=True)
        around = make_pre_post_processors(config, str(place), preprocessor_overrides=override)
    check_numbers(policy, around, place)
    before, after = map(without_steps, around)  # an operator sees and acts through the interface itself
    policy.eval()
    policy.eval = lambda: policy  # LeRobot asks for it twice an action: a third of its time
    return TrainedPolicy(meta, policy, before, after, encoder_of(around[0]))


@contextmanager
def repeatable(seed: int) -> Iterator[None]:
    """Let what a policy draws depend on the seed alone; what others draw is as before."""
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(seed)
        yield


def load_weights(policy: torch.nn.Module, place: Path) -> None:
    """Load the weights of a checkpoint into a policy: all there, none of another."""
    with restated(f"policy {str(place)!r}"):  # PyTorch's and safetensors': whatever the file holds is refused
        load_model(policy, place / WEIGHTS, strict=True)


def check_numbers(policy: torch.nn.Module, pipelines: tuple[Any, ...], place: Path) -> None:
    """Check that weights are finite, and statistics those of every feature that is normalised, or of none."""
    wrong = [name for name, values in policy.named_parameters() if not values.isfinite().all()]
    wrong += [name for name, values in policy.named_buffers() if values.isnan().any()]
    if wrong:
        raise HandrailError(f"policy {str(place)!r}: expected finite weights, got others in {wrong[0]}")
    for step in (step for pipeline in pipelines for step in pipeline.steps):
        if type(step) not in (NormalizerProcessorStep, UnnormalizerProcessorStep) or not step.stats:
            continue
        for key, feature in step.features.items():
            mode = step.norm_map.get(feature.type, NormalizationMode.IDENTITY)
            applies = type(step) is NormalizerProcessorStep or feature.type is FeatureType.ACTION
            if applies and mode is not NormalizationMode.IDENTITY:
                _check_statistics(step.stats.get(key, {}), key, feature, place)


def _check_statistics(stats: Mapping[str, Any], key: str, feature: Any, place: Path) -> None:
    shape = None if feature.type is FeatureType.VISUAL else tuple(feature.shape)
    trouble = "" if stats else "got none"
    for name, values in ((name, torch.as_tensor(values)) for name, values in stats.items()):
        if not values.isfinite().all():
            trouble = f"got NaN or infinity in {name}"
        elif name != "count" and shape not in (None, tuple(values.shape)):
            trouble = f"of shape {shape}, got {tuple(values.shape)} in {name}"
    if trouble:
        raise HandrailError(f"policy {str(place)!r}: expected finite statistics of {key}, {trouble}")
