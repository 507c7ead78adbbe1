"""An encoder: pictures and the robot's state become `observation.environment_state`, which nobody tells then.

Of every object whose pose or position the environment's state has, each camera says

    u, v, log ρ        where it is in the picture, how far away        log σ_l, log σ_d   (`views.py`)
    M = Rᵀ R_o         how it is turned, two columns, (6,)             log b   3 b: how far that is off

from its picture alone; where the camera is (c, R) follows from the robot's state. Other numbers of the
environment's state, such as obstacles on the floor, stay zero: nothing is there.
"""

import hashlib
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
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation
from torch import Tensor

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError, restated, unknown_name
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.typed import Count, Name, decoded
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.network import Network
from handrail.policies.imitation.interface.relative import POSE, POSITION
from handrail.policies.imitation.interface.views import PLACED, CameraMount, facing, placed, spread

_SMOOTH = 40.0  # of a saliency: a picture's height over the standard deviation
_MOVED = 1e-3  # of a camera [m], and of its axes
_FINEST = 5e-3  # how far something is turned off at least
_SAID = {POSITION: PLACED, POSE: PLACED + 7}  # numbers that the network says of an object
OWN = Path(__file__).parents[1] / "encoder" / "weights"
FORMAT = "handrail.encoder/2"


@dataclass(frozen=True)
class Reads:
    """The inputs and outputs of an encoder; saved with it."""

    robot: Name
    task: Name
    cameras: Mapping[Name, CameraMount]
    interface: PolicyInterface
    """Names of the recorded numbers."""
    turns: Mapping[Name, Count]
    """Objects that look the same after so many-th of a turn around their z axis."""
    movable: tuple[Name, ...] = ()
    """Objects that may move; the others stand."""

    @cached_property
    def objects(self) -> tuple[tuple[str, tuple[str, ...], int], ...]:
        """The objects that it tells of: name, parts of the numbers, where they begin."""
        return tuple(each for each in self.interface.objects if each[1] in _SAID)

    @property
    def pictures(self) -> dict[Name, tuple[Count, Count]]:
        """Height and width of the pictures [px], by camera."""
        return {name: camera.size for name, camera in self.cameras.items()}

    def check_robot(self, model: RobotModel) -> None:
        """Check that a robot has the cameras where they were in training."""
        for camera in model.description.cameras:
            if mount := self.cameras.get(camera.name):
                found = CameraMount.of(camera, model, mount.size)
                if found.on != mount.on or not np.allclose(found.numbers, mount.numbers, atol=_MOVED):
                    words = f"expected camera {camera.name} where {self.robot} has it"
                    raise HandrailError(f"encoder: {words}; that of {model.description.name} is elsewhere")

    @property
    def sizes(self) -> list[int]:
        """How many numbers the network says of each object."""
        return [_SAID[parts] for _, parts, _ in self.objects]


@dataclass(frozen=True)
class Said:
    """A camera's estimates of one object at T moments, in the world's axes."""

    tools: FloatArray
    """Where the hands' tools are, (T, h, 3) [m]."""
    position: FloatArray
    """(T, 3) [m]."""
    spread: FloatArray
    """Σ, (T, 3, 3) [m²]."""
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
        heights = {name: camera.size[0] for name, camera in reads.cameras.items()}
        self.reads = reads
        self.network = network or Network(heights, reads.sizes)
        self.network.eval()

    @classmethod
    def load(cls, path: Path) -> "Encoder":
        """Read an encoder from its file; that runs no code of whoever made it."""
        where = f"encoder {str(path)!r}"
        with restated(where, (OSError, SafetensorError, ValueError)), safe_open(path, "pt") as file:
            said = json.loads((file.metadata() or {}).get(FORMAT, "null"))
            weights = {name: file.get_tensor(name).float() for name in file.keys()}  # noqa: SIM118
        return cls.of(said, weights, where)

    @classmethod
    def of(cls, reads: object, weights: Mapping[str, Tensor], where: str) -> "Encoder":
        """Return an encoder from what its file has."""
        encoder = cls(decoded(reads, Reads, where))
        with restated(where, (RuntimeError, ValueError, AttributeError)):
            encoder.network.load_state_dict(dict(weights), strict=True)
        if not all(values.isfinite().all() for values in encoder.network.state_dict().values()):
            raise HandrailError(f"{where}: expected finite weights, got NaN or infinity")
        return encoder

    def save(self, path: Path) -> None:
        """Write the encoder to a file, its weights as float16."""
        with explained(f"cannot write {str(path)!r}"):
            write_whole(path, self._bytes)

    @property
    def _bytes(self) -> bytes:
        weights = {name: each.half().contiguous() for name, each in self.network.state_dict().items()}
        return save(weights, {FORMAT: json.dumps(asdict(self.reads))})

    @cached_property
    def digest(self) -> str:
        """A digest that tells it apart from others."""
        return hashlib.sha256(self._bytes).hexdigest()[:16]

    def read(self, pictures: Mapping[str, NDArray[np.uint8] | Tensor]) -> FloatArray:
        """Return the network's numbers, (T, cameras, n) float32.

        Args:
            pictures: by camera: 0 to 255, (T, height, width, 3); or 0 to 1, (T, 3, height, width).
        """
        with torch.inference_mode(), torch.autocast("cpu", enabled=False):  # LeRobot's use_amp=true
            return self.network(self._tensors(pictures)).numpy()

    def saliency(self, pictures: Mapping[str, NDArray[np.uint8]]) -> dict[str, FloatArray]:
        """Return how much each pixel matters to what is said, by camera, (height, width), 0 to 1.

        That is `‖∂(u, v, log ρ) / ∂pixel‖ / σ_l`, smoothed, of all objects.

        Args:
            pictures: of a moment, by camera, (height, width, 3).
        """
        tensors = self._tensors({name: each[None] for name, each in pictures.items()})
        given = [each.requires_grad_() for each in tensors.values()]
        numbers = self.network(tensors)[0].sum(0)
        starts = np.cumsum([0, *self.reads.sizes[:-1]]).tolist()
        heat = [torch.zeros(each.shape[2:]) for each in given]
        for number in (
            numbers[start + axis] / numbers[start + 3].detach().exp() for start in starts for axis in range(3)
        ):
            for total, slope in zip(heat, torch.autograd.grad(number, given, retain_graph=True), strict=True):
                total += slope[0].square().sum(0)
        smooth = [gaussian_filter(each.sqrt().numpy(), len(each) / _SMOOTH) for each in heat]
        return {name: each / max(each.max(), 1e-12) for name, each in zip(tensors, smooth, strict=True)}

    def _tensors(self, pictures: Mapping[str, NDArray[np.uint8] | Tensor]) -> dict[str, Tensor]:
        """Return pictures as the network takes them, those of its cameras."""
        tensors = dict[str, Tensor]()
        for name, camera in self.reads.cameras.items():
            given, size = pictures.get(name), camera.size
            if isinstance(given, np.ndarray):
                given = torch.from_numpy(np.ascontiguousarray(given)).movedim(-1, 1) / 255.0
            if given is None or tuple(given.shape[1:]) != (3, *size):
                got = "none" if given is None else f"some of shape {tuple(given.shape[1:])}"
                words = f"expected pictures of camera {name}, {size[1]} x {size[0]} pixels"
                raise HandrailError(f"encoder: {words}, got {got}")
            tensors[name] = given
        return tensors

    def said(self, numbers: FloatArray, states: FloatArray) -> dict[str, list[Said]]:
        """Return what the network's numbers, (T, cameras, n), say, by object, of each camera.

        Args:
            numbers: of `read`.
            states: of the robot, as recorded, (T, s).
        """
        names, found = self.reads.interface, {name: [] for name, _, _ in self.reads.objects}
        poses = [names.pose(states, hand) for hand in range(len(names.tools))]
        tools = np.stack([pose.tool for pose in poses], axis=1)
        for camera, said in zip(
            self.reads.cameras.values(), np.moveaxis(numbers.astype(float), 1, 0), strict=True
        ):
            place, turn = camera.view(poses[0])
            slope = torch.full((len(said),), camera.slope, dtype=torch.float64)
            parts = np.split(said, np.cumsum(self.reads.sizes)[:-1], axis=1)
            for (name, _, _), each in zip(self.reads.objects, parts, strict=True):
                d, ray, width = (of.numpy() for of in placed(torch.from_numpy(each), slope, camera.size))
                way, rays = (np.einsum("tij,tj->ti", turn, of) for of in (d, ray))
                m, r = each[:, PLACED:-1], each[:, -1]
                turned = (turn @ facing(ray) @ orthonormal(m), widths(r)) if m.size else ()
                found[name].append(Said(tools, place + way, spread(rays, width), *turned))
        return found


def find_encoder(name: str) -> Encoder:
    """Return an encoder by its name, or from its file."""
    own = {path.stem: path for path in sorted(OWN.glob("*.safetensors"))}
    path = own.get(name) or Path(name).expanduser()
    if not path.is_file():
        raise unknown_name("encoder", name, [*own, "a file of handrail-encoder"])
    return Encoder.load(path)


def same(turns: int) -> FloatArray:
    """Return the rotations after which an object looks the same, (turns, 3, 3)."""
    angles = 2.0 * np.pi * np.arange(turns) / turns
    return Rotation.from_euler("z", angles[:, None]).as_matrix()


def widths(numbers: FloatArray) -> FloatArray:
    """Return how far something is off, `3 b`, `b = e^s`, of what the network says.

    That is the mean of ‖e‖ where e has the density `∝ e^(−‖e‖ / b)`, as in training.
    """
    return np.maximum(3.0 * np.exp(np.clip(numbers, -8.0, 3.0)), _FINEST)


def orthonormal(columns: FloatArray) -> FloatArray:
    """Return the rotations, (T, 3, 3), of which two columns, (T, 6), are roughly known."""
    first, second = columns[:, :3], columns[:, 3:]
    first = first / np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-9)
    second = second - np.sum(first * second, axis=1, keepdims=True) * first
    second = second / np.maximum(np.linalg.norm(second, axis=1, keepdims=True), 1e-9)
    return np.stack([first, second, np.cross(first, second)], axis=2)
