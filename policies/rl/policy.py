"""The trained actor without PyTorch: a small network in plain arrays."""

import io
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.errors import HandrailError, restated
from handrail.controllers.regular_file import open_regular
from handrail.datasets.storage.atomic import write_whole
from handrail.policies.rl.observation import ACTION_SIZE, OBSERVATION_SIZE

SHIPPED = Path(__file__).parent / "actor"  # the actor that comes with Handrail, and how it was trained


@dataclass(frozen=True)
class Actor:
    """The mean action `tanh(W_k relu(… relu(W_1 o + b_1) …) + b_k)` of a soft actor-critic policy."""

    weights: tuple[FloatArray, ...]  # one matrix a layer, (out, in)
    biases: tuple[FloatArray, ...]  # one vector a layer, (out,)

    def __post_init__(self) -> None:
        """Copy the arrays, make them read-only, and check that they fit."""
        for name in ("weights", "biases"):
            arrays = tuple(frozen(array, np.float32) for array in getattr(self, name))
            object.__setattr__(self, name, arrays)
        sizes = (OBSERVATION_SIZE, *(bias.size for bias in self.biases))
        wanted = [(out, into) for into, out in itertools.pairwise(sizes)]
        found = [weight.shape for weight in self.weights]
        if found != wanted or sizes[-1] != ACTION_SIZE:
            raise HandrailError(f"layers of an actor: expected {wanted}, got {found}")
        if not all(np.all(np.isfinite(array)) for array in self.weights + self.biases):
            raise HandrailError("weights of an actor: expected finite numbers")

    def __call__(self, observation: FloatArray) -> FloatArray:
        """Return the action in [−1, 1] for an observation, (54,) → (3,)."""
        values = np.asarray(observation, dtype=np.float32)
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            values = np.maximum(weight @ values + bias, 0.0)
        return np.tanh(self.weights[-1] @ values + self.biases[-1])

    @classmethod
    def mean(cls, actors: Sequence["Actor"]) -> "Actor":
        """Return the actor whose weights are the means of others' weights; they must have the same layers."""
        weights = zip(*(actor.weights for actor in actors), strict=True)
        biases = zip(*(actor.biases for actor in actors), strict=True)
        return cls(
            tuple(np.mean(layer, axis=0) for layer in weights),
            tuple(np.mean(layer, axis=0) for layer in biases),
        )

    def save(self, path: Path) -> None:
        """Write the arrays to an .npz file."""
        arrays: dict[str, Any] = {f"weight_{i}": weight for i, weight in enumerate(self.weights)}
        arrays |= {f"bias_{i}": bias for i, bias in enumerate(self.biases)}
        stream = io.BytesIO()
        np.savez_compressed(stream, **arrays)
        write_whole(path, stream.getvalue())

    @classmethod
    def load(cls, path: Path | None = None) -> "Actor":
        """Read an actor from an .npz file; the one that comes with Handrail by default."""
        path = path or SHIPPED / "actor.npz"
        what = f"actor {path}: expected an .npz file"  # NumPy and zipfile say in many ways that it is none
        with restated(what), open_regular(path) as file, np.load(file, allow_pickle=False) as arrays:
            layers = range(len(arrays.files) // 2)
            weights = tuple(arrays[f"weight_{i}"] for i in layers)
            biases = tuple(arrays[f"bias_{i}"] for i in layers)
        return cls(weights, biases)
