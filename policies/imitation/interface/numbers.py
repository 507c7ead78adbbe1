"""Whether the numbers of a checkpoint are its policy's: all there, none of another, each finite."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import torch
from lerobot.configs import FeatureType, NormalizationMode
from lerobot.processor import NormalizerProcessorStep, UnnormalizerProcessorStep
from safetensors.torch import load_model

from handrail.controllers.errors import HandrailError, message_of
from handrail.policies.imitation.interface.trust import WEIGHTS


def load_weights(policy: torch.nn.Module, place: Path) -> None:
    """Load the weights of a checkpoint into a policy."""
    try:
        load_model(policy, place / WEIGHTS, strict=True)
    except Exception as error:  # of PyTorch and safetensors: whatever the file holds, it is refused
        raise HandrailError(f"policy {str(place)!r}: {message_of(error)}") from error
    check_weights(policy, place)


def check_weights(policy: torch.nn.Module, place: Path) -> None:
    """Check the weights that a policy has."""
    wrong = [name for name, values in policy.named_parameters() if not values.isfinite().all()]
    wrong += [name for name, values in policy.named_buffers() if values.isnan().any()]
    if wrong:
        raise HandrailError(
            f"policy {str(place)!r}: expected finite weights, got NaN or infinity in {wrong[0]}"
        )


def check_statistics(pipeline: Any, place: Path) -> None:
    """Check the statistics of a processor: of every feature that it normalises, or of none."""
    for step in pipeline.steps:
        if type(step) in (NormalizerProcessorStep, UnnormalizerProcessorStep) and step.stats:
            for trouble in _troubles(step):
                raise HandrailError(f"policy {str(place)!r}: expected finite statistics of {trouble}")


def _troubles(step: Any) -> Iterator[str]:
    """Yield each feature whose statistics are not as they have to be, and what they are."""
    actions = isinstance(step, UnnormalizerProcessorStep)
    for key, feature in step.features.items():
        mode = step.norm_map.get(feature.type, NormalizationMode.IDENTITY)
        if mode is NormalizationMode.IDENTITY or (actions and feature.type is not FeatureType.ACTION):
            continue
        found = {name: torch.as_tensor(values) for name, values in step.stats.get(key, {}).items()}
        fits = feature.type is FeatureType.VISUAL
        if not found:
            yield f"{key}, got none"
        for name, values in found.items():
            if not values.isfinite().all():
                yield f"{key}, got NaN or infinity in {name}"
            if not fits and name != "count" and tuple(values.shape) != tuple(feature.shape):
                yield f"{key} of shape {tuple(feature.shape)}, got {tuple(values.shape)} in {name}"
