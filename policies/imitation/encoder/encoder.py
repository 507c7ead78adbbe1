"""An encoder: pictures and the robot's state become `observation.environment_state`, which nobody tells then.

Of every object whose pose or position the environment's state has, the network says in the base's axes

    d = R_wbᵀ (p_o − p_t)    where it is from the tool [m], (3,)      b     how far that is off [m]
    M = R_wbᵀ R_o            how it is turned, two columns, (6,)      b_r   how far that is off

What it has said before is remembered, in the world's axes: `x ← (λ w x + v y) / (λ w + v)` with the weight
`v = 1 / b²` of what it says now and `w ← λ w + v` of all before; what is far from that begins anew.
Other numbers of the environment's state, such as obstacles on the floor, stay zero: nothing is there.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from scipy.spatial.transform import Rotation
from torch import Tensor

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError, message_of
from handrail.controllers.typed import Count, Name, decoded
from handrail.datasets.storage.atomic import write_whole
from handrail.policies.imitation.encoder.network import Network
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.relative import POSE, POSITION, RobotPose

_KEPT = 0.9  # λ, a frame
_SURPRISE = 4.0  # of what is expected to be off: from there on it begins anew
_FINEST = 2e-3  # b and b_r are at least that [m, 1]
_SAID = {POSITION: 4, POSE: 11}  # numbers that the network says: d, b; and M, b_r
FORMAT = "handrail.encoder/1"


@dataclass(frozen=True)
class Reads:
    """What an encoder reads, and what it says; saved with it."""

    robot: Name
    task: Name
    cameras: Mapping[Name, tuple[Count, Count]]
    """Height and width of the pictures [px], by camera."""
    interface: PolicyInterface
    """Names of the recorded numbers, and the robot's state as policies read it."""
    turns: Mapping[Name, Count]
    """Objects that look the same after so many-th of a turn around their z axis."""

    @cached_property
    def objects(self) -> tuple[tuple[str, tuple[str, ...], int], ...]:
        """The objects that it tells of: name, parts of the numbers, where they begin."""
        return tuple(each for each in self.interface.objects if each[1] in _SAID)

    @property
    def size(self) -> int:
        """How many numbers the network says."""
        return sum(_SAID[parts] for _, parts, _ in self.objects)


@dataclass(frozen=True)
class Said:
    """What is said of one object at T moments, in the world's axes."""

    position: FloatArray
    """(T, 3) [m]."""
    off: FloatArray
    """How far that is off, (T,) [m]."""
    rotation: FloatArray | None = None
    """(T, 3, 3); None of an object that has none."""
    turned_off: FloatArray | None = None
    """How far that is off, (T,)."""


class Encoder:
    """Reads where things are from pictures.

    Args:
        reads: what it reads.
        network: that does.
    """

    def __init__(self, reads: Reads, network: Network | None = None) -> None:
        state, _ = reads.interface.observation_names
        heights = {name: height for name, (height, _) in reads.cameras.items()}
        self.reads = reads
        self.network = network or Network(heights, len(state), reads.size)
        self.network.eval()
        self.forget()

    @classmethod
    def load(cls, path: Path) -> "Encoder":
        """Read an encoder from its file; that runs no code of whoever made it."""
        try:
            with safe_open(path, "pt") as file:
                said = json.loads((file.metadata() or {}).get(FORMAT, "null"))
                weights = {name: file.get_tensor(name).float() for name in file.keys()}  # noqa: SIM118
        except (OSError, SafetensorError, ValueError) as error:
            raise HandrailError(f"encoder {str(path)!r}: {message_of(error)}") from error
        return cls.of(said, weights, f"encoder {str(path)!r}")

    @classmethod
    def of(cls, reads: object, weights: Mapping[str, Tensor], where: str) -> "Encoder":
        """Return an encoder from what its file has."""
        encoder = cls(decoded(reads, Reads, where))
        try:
            encoder.network.load_state_dict(dict(weights), strict=True)
        except (RuntimeError, ValueError, AttributeError) as error:
            raise HandrailError(f"{where}: {message_of(error)}") from error
        if not all(values.isfinite().all() for values in encoder.network.state_dict().values()):
            raise HandrailError(f"{where}: expected finite weights, got NaN or infinity")
        return encoder

    def save(self, path: Path) -> None:
        """Write the encoder to a file, its weights as float16."""
        weights = {name: each.half().contiguous() for name, each in self.network.state_dict().items()}
        write_whole(path, save(weights, {FORMAT: json.dumps(asdict(self.reads))}))

    def forget(self) -> None:
        """Forget what was seen: an episode begins."""
        self._known: dict[str, _Known] = {}

    def read(self, pictures: Mapping[str, NDArray[np.uint8]], states: FloatArray) -> FloatArray:
        """Return the environment's state at moments that follow each other, (T, e) float32.

        Args:
            pictures: by camera, (T, height, width, 3) each.
            states: of the robot, as recorded, (T, s).
        """
        tensors = {}
        for name, size in self.reads.cameras.items():
            given = pictures.get(name)
            if given is None or given.shape[1:] != (*size, 3):
                got = "none" if given is None else f"{given.shape[2]} x {given.shape[1]}"
                words = f"expected pictures of camera {name}, {size[1]} x {size[0]} pixels, got {got}"
                raise HandrailError(f"encoder: {words}")
            tensors[name] = torch.from_numpy(np.ascontiguousarray(given)).permute(0, 3, 1, 2) / 255.0
        return self.remembered(self.look(tensors, states), len(states))

    def look(self, pictures: Mapping[str, Tensor], states: FloatArray) -> dict[str, Said]:
        """Return what the pictures of T moments say, by object, without any memory."""
        interface = self.reads.interface
        with torch.inference_mode():
            numbers = self.network(pictures, torch.from_numpy(interface.observe_robot(states)))
        return self.said(numbers.double().numpy(), interface.pose(states))

    def said(self, numbers: FloatArray, pose: RobotPose) -> dict[str, Said]:
        """Return what the network's numbers (T, …) say, by object."""
        found, start = dict[str, Said](), 0
        for name, parts, _ in self.reads.objects:
            d, b, m, r = np.split(numbers[:, start : start + _SAID[parts]], [3, 4, 10], axis=1)
            start += _SAID[parts]
            place = pose.tool + pose.turned_back(d)
            found[name] = Said(place, widths(b[:, 0]))
            if parts == POSE:
                found[name] = Said(place, widths(b[:, 0]), pose.matrices @ orthonormal(m), widths(r[:, 0]))
        return found

    def remembered(self, said: Mapping[str, Said], count: int) -> FloatArray:
        """Return the environment's state of T moments, (T, e) float32; what is said is remembered."""
        rows = np.zeros((count, len(self.reads.interface.environment_names)), np.float32)
        for name, parts, start in self.reads.objects:
            known = self._known.setdefault(name, _Known(self.reads.turns.get(name, 1)))
            for row, moment in zip(rows, range(count), strict=True):
                row[start : start + len(parts)] = known.take(said[name], moment)
        return rows


class _Known:
    """What is known of an object, from all that was said.

    Args:
        turns: it looks the same after so many-th of a turn around its z axis.
    """

    def __init__(self, turns: int) -> None:
        self._same = same(turns)
        self._weight, self._place = 0.0, np.zeros(3)
        self._turn_weight, self._turn = 0.0, np.eye(3)

    def take(self, said: Said, moment: int) -> FloatArray:
        """Take what is said at a moment; return position, and quaternion if it has one, (3,) or (7,)."""
        place, off = said.position[moment], said.off[moment]
        surprise = np.linalg.norm(place - self._place)
        if self._weight and surprise > _SURPRISE * np.hypot(off, self._weight**-0.5):
            self._weight = self._turn_weight = 0.0
        before, now = _KEPT * self._weight, off**-2.0
        self._weight = before + now
        self._place = (before * self._place + now * place) / self._weight
        if said.rotation is None or said.turned_off is None:
            return self._place
        ways = said.rotation[moment] @ self._same
        turn = ways[np.argmax(np.einsum("kij,ij->k", ways, self._turn))]
        before, now = _KEPT * self._turn_weight, said.turned_off[moment] ** -2.0
        self._turn_weight = before + now
        mixed = Rotation.from_matrix(np.stack([self._turn, turn])).mean([before, now])
        self._turn = mixed.as_matrix()
        return np.append(self._place, mixed.as_quat(canonical=True, scalar_first=True))


def same(turns: int) -> FloatArray:
    """Return the rotations after which an object looks the same, (turns, 3, 3)."""
    angles = 2.0 * np.pi * np.arange(turns) / turns
    return Rotation.from_euler("z", angles[:, None]).as_matrix()


def widths(numbers: FloatArray) -> FloatArray:
    """Return how far something is off, `b = e^s`, of what the network says."""
    return np.maximum(np.exp(np.clip(numbers, -8.0, 3.0)), _FINEST)


def orthonormal(columns: FloatArray) -> FloatArray:
    """Return the rotations, (T, 3, 3), of which two columns, (T, 6), are roughly known."""
    first, second = columns[:, :3], columns[:, 3:]
    first = first / np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-9)
    second = second - np.sum(first * second, axis=1, keepdims=True) * first
    second = second / np.maximum(np.linalg.norm(second, axis=1, keepdims=True), 1e-9)
    return np.stack([first, second, np.cross(first, second)], axis=2)
