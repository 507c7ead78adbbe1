"""An encoder as a step of LeRobot's processors, inside a checkpoint: who loads it needs no more."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import torch
from lerobot.processor import IdentityProcessorStep, ObservationProcessorStep, ProcessorStepRegistry

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import decoded
from handrail.datasets.recording.frames import PICTURE
from handrail.policies.imitation.interface.checkpoint import as_json
from handrail.policies.imitation.interface.encoder import Encoder, Reads
from handrail.policies.imitation.interface.interface import ENVIRONMENT, STATE, PolicyInterface
from handrail.policies.imitation.interface.scene_memory import SceneMemory
from handrail.policies.imitation.interface.trust import ENCODE

_TIME = "observation.time"


class OwnStep(IdentityProcessorStep):
    """A step of our own, a dataclass whose fields make it again.

    Features stay as they are: LeRobot asks the steps of robots for theirs, never a policy's.
    """

    def get_config(self) -> dict[str, Any]:
        """Return what makes this step again."""
        return {field.name: getattr(self, field.name) for field in fields(self)}  # pyright: ignore[reportArgumentType]


@ProcessorStepRegistry.register(ENCODE)
@dataclass(eq=False)
class PolicyEncoderStep(ObservationProcessorStep, OwnStep):
    """Reads from pictures where things are, as `observation.environment_state`, whatever is told of it."""

    reads: dict[str, Any]
    """The encoder's inputs and outputs, as JSON."""

    def __post_init__(self) -> None:
        """Make the encoder; its weights come later."""
        self.encoder = Encoder(decoded(self.reads, Reads, f"step {ENCODE}"))
        self.reset()

    def observation(self, observation: dict[str, Any]) -> dict[str, Any]:
        """Return the observation with what the pictures say."""
        reads, names = self.encoder.reads, self.encoder.reads.interface
        shown = apart(observation, names)
        states, device = numbers_of(shown, STATE, len(names.state_names), ENCODE), shown[STATE].device
        pictures = {
            name: shown[key].detach().cpu().reshape(-1, *shown[key].shape[-3:])
            for name in reads.cameras
            if isinstance(shown.get(key := PICTURE + name), torch.Tensor)
        }
        said = self.encoder.said(self.encoder.read(pictures), states)
        self._memories += [SceneMemory(reads) for _ in states[len(self._memories) :]]
        self._forget(shown.get(_TIME))
        moments = zip(self._memories, range(len(states)), strict=False)
        rows = np.stack([memory.take(said, moment) for memory, moment in moments])
        around = torch.as_tensor(rows, device=device)
        shown[ENVIRONMENT] = around.reshape(*shown[STATE].shape[:-1], rows.shape[1])
        return shown

    def _forget(self, times: object) -> None:
        """Forget where an episode begins: where the time is not later."""
        if isinstance(times, torch.Tensor):
            before, self._times = self._times, times.detach().cpu().numpy().ravel()
            for row, now, then in zip(range(len(self._memories)), self._times, before, strict=False):
                if now <= then:
                    self._memories[row] = SceneMemory(self.encoder.reads)

    def state_dict(self) -> dict[str, torch.Tensor]:
        """Return the encoder's weights."""
        return dict(self.encoder.network.state_dict())

    def load_state_dict(self, state: dict[str, torch.Tensor]) -> None:
        """Take the encoder's weights."""
        self.encoder = Encoder.of(self.reads, state, f"step {ENCODE}")

    def reset(self) -> None:
        """Forget what was seen."""
        self._memories: list[SceneMemory] = []
        self._times = np.zeros(0)


def apart(observation: Mapping[str, Any], interface: PolicyInterface) -> dict[str, Any]:
    """Return an observation with robot and scene apart.

    A robot of LeRobot's, such as `handrail_sim`, shows them as one vector, `observation.state`.
    """
    shown = dict(observation)
    sizes = [len(interface.state_names), len(interface.environment_names)]
    if ENVIRONMENT not in shown and size_of(shown.get(STATE)) == sum(sizes):
        shown[STATE], shown[ENVIRONMENT] = torch.split(shown[STATE], sizes, dim=-1)
    return shown


def encoder_step(encoder: Encoder) -> PolicyEncoderStep:
    """Return the step of an encoder."""
    step = PolicyEncoderStep(as_json(encoder.reads))
    step.encoder = encoder
    return step


def encoder_of(pipeline: Any) -> Encoder | None:
    """Return the encoder of a processor, if it has one."""
    return next((step.encoder for step in pipeline.steps if isinstance(step, PolicyEncoderStep)), None)


def numbers_of(observation: Mapping[str, Any], key: str, size: int, step: str) -> FloatArray:
    """Return the numbers under a key, (B, size)."""
    values = observation.get(key)
    if not isinstance(values, torch.Tensor) or size_of(values) != size:
        raise HandrailError(
            f"step {step}: expected {key} with {size} numbers, as recorded; got {shape_of(values)}"
        )
    return values.detach().cpu().numpy().reshape(-1, size)


def size_of(values: Any) -> int:
    """Return the size of a tensor's last dimension; 0 of none."""
    return values.shape[-1] if isinstance(values, torch.Tensor) and values.ndim else 0


def shape_of(values: Any) -> object:
    """Return the shape of a tensor, for a message."""
    return "none" if values is None else list(getattr(values, "shape", ()))
