"""What PyTorch holds while a policy trains or drives: threads, random numbers, weights, statistics."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import torch
from lerobot.configs import FeatureType, NormalizationMode
from lerobot.processor import NormalizerProcessorStep, UnnormalizerProcessorStep
from safetensors.torch import load_model

from handrail.controllers.errors import HandrailError, message_of
from handrail.policies.imitation.interface.trust import WEIGHTS


@contextmanager
def threads(count: int) -> Iterator[None]:
    """Let PyTorch use so many threads: processes share the cores."""
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@contextmanager
def repeatable(seed: int) -> Iterator[None]:
    """Let what a policy draws depend on the seed alone; what others draw is as before."""
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(seed)
        yield


def load_weights(policy: torch.nn.Module, place: Path) -> None:
    """Load the weights of a checkpoint into a policy: all there, none of another."""
    try:
        load_model(policy, place / WEIGHTS, strict=True)
    except Exception as error:  # of PyTorch and safetensors: whatever the file holds, it is refused
        raise HandrailError(f"policy {str(place)!r}: {message_of(error)}") from error


def check_numbers(policy: torch.nn.Module, pipelines: tuple[Any, ...], place: Path) -> None:
    """Check that weights are finite, and statistics those of every feature that is normalised, or of none."""
    wrong = [name for name, values in policy.named_parameters() if not values.isfinite().all()]
    wrong += [name for name, values in policy.named_buffers() if values.isnan().any()]
    if wrong:
        raise HandrailError(
            f"policy {str(place)!r}: expected finite weights, got NaN or infinity in {wrong[0]}"
        )
    for step in (step for pipeline in pipelines for step in pipeline.steps):
        if type(step) in (NormalizerProcessorStep, UnnormalizerProcessorStep) and step.stats:
            for key, feature in step.features.items():
                mode = step.norm_map.get(feature.type, NormalizationMode.IDENTITY)
                applies = type(step) is NormalizerProcessorStep or feature.type is FeatureType.ACTION
                if applies and mode is not NormalizationMode.IDENTITY:
                    _check_statistics(step.stats.get(key, {}), key, feature, place)


def _check_statistics(stats: Mapping[str, Any], key: str, feature: Any, place: Path) -> None:
    trouble = "" if stats else "got none"
    shape = tuple(feature.shape)
    for name, values in ((name, torch.as_tensor(values)) for name, values in stats.items()):
        if not values.isfinite().all():
            trouble = f"got NaN or infinity in {name}"
        elif name != "count" and feature.type is not FeatureType.VISUAL and tuple(values.shape) != shape:
            trouble = f"of shape {shape}, got {tuple(values.shape)} in {name}"
    if trouble:
        raise HandrailError(f"policy {str(place)!r}: expected finite statistics of {key}, {trouble}")
