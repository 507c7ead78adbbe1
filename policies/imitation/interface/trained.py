"""A trained policy that drives."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import draccus
import numpy as np
import torch
from lerobot.policies.factory import get_policy_class, make_pre_post_processors

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError, message_of
from handrail.policies.imitation.interface.checkpoint import NAME, PolicyMeta, model_folder, read_meta
from handrail.policies.imitation.interface.interface import ENVIRONMENT, STATE, PolicyInterface
from handrail.policies.imitation.interface.steps import interface_in, without_steps
from handrail.policies.imitation.interface.torch_state import check_numbers
from handrail.policies.imitation.interface.trust import check_policy_folder, registered_policies


@dataclass(frozen=True)
class TrainedPolicy:
    """A policy that can drive."""

    interface: PolicyInterface | None
    """What it reads and writes; None if that is what was recorded."""
    meta: PolicyMeta | None
    """What it is; None of a policy of plain LeRobot."""
    policy: Any
    """LeRobot's."""
    before: Callable[[dict[str, Any]], dict[str, Any]]
    """LeRobot's preprocessor: normalises."""
    after: Callable[[Any], Any]
    """LeRobot's postprocessor: the reverse."""

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
            batch[f"observation.images.{camera}"] = pixels[None].float() / 255.0
        batch["task"] = [task]
        try:
            with torch.inference_mode():
                return self.after(self.policy.select_action(self.before(batch)))[0].cpu().numpy()
        except Exception as error:  # of LeRobot and all below it
            raise HandrailError(
                f"policy {self.policy.config.type}: cannot act: {message_of(error)}"
            ) from error


def load_policy(folder: str | Path, device: str = "cpu") -> TrainedPolicy:
    """Load a policy from a `pretrained_model` folder, a checkpoint, or a training's folder (the last one).

    Whoever made it, loading it runs no code of theirs (`trust.py`).
    """
    place = model_folder(Path(folder).expanduser())
    meta = read_meta(place) if (place / NAME).is_file() else None
    settings = check_policy_folder(place)
    kind, override = settings.pop("type"), {"device_processor": {"device": device}}
    try:
        config = draccus.decode(registered_policies()[kind], settings | {"device": device})
        policy = get_policy_class(kind).from_pretrained(place, config=config, strict=True)
        around = make_pre_post_processors(config, str(place), preprocessor_overrides=override)
    except Exception as error:  # of LeRobot and all below it: whatever the files hold, they are refused
        raise HandrailError(f"policy {str(place)!r}: {message_of(error)}") from error
    check_numbers(policy, around, place)
    stepped, said = interface_in(around[0]), meta.interface if meta else None
    if stepped is not None and said not in (None, stepped):
        raise HandrailError(f"policy {str(place)!r}: expected {NAME} and the steps to agree on the interface")
    before, after = map(without_steps, around)  # an operator sees and acts through the interface itself
    policy.eval()
    policy.eval = lambda: policy  # LeRobot asks for it twice an action: a third of its time
    return TrainedPolicy(said or stepped, meta, policy, before, after)
