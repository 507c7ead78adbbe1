"""The network that says from pictures where things are: an eye for each camera; beside it the robot's state.

    f = convolutions of a picture                      (k, h, w), group norm; its size is halved twice or more
    u_j = Σ softmax(t f_j) (x, y)                      where the j-th feature is, (k, 2): a spatial softmax
    y = MLP(u, max f, mean f of every eye; state)

Spatial softmax: Finn et al., Deep spatial autoencoders for visuomotor learning, ICRA 2016.
"""

from collections.abc import Mapping

import torch
from torch import Tensor, nn

_FEATURES = 32  # k, of an eye
_HIDDEN = 256
_SMALL = 160  # pictures up to this height are halved once less [px]
_LARGE = 300  # from this height on an eye has half the channels [px]
_HALVES = bool(getattr(torch.cpu, "get_capabilities", dict)().get("amx_bf16"))  # half the time


class Eye(nn.Module):
    """Looks at the pictures of one camera.

    Args:
        height: of its pictures [px].
    """

    def __init__(self, height: int) -> None:
        super().__init__()
        width = 16 if height > _LARGE else 32
        stem = (5, 2, 2) if height <= _SMALL else (7, 4, 3)
        self.look = nn.Sequential(
            *_layer(3, width, *stem),
            *_layer(width, 2 * width, 3, 2, 1),
            *_layer(2 * width, 2 * width, 3, 1, 1),
            *_layer(2 * width, 2 * width, 3, 1, 1),
            nn.Conv2d(2 * width, _FEATURES, 1),
        )
        self.sharpness = nn.Parameter(torch.ones(1))

    def forward(self, pictures: Tensor) -> Tensor:
        """Return what there is and where, (B, 4 k), in pictures from −1 to 1, (B, 3, height, width)."""
        kind = pictures.device.type
        with torch.autocast(kind, torch.bfloat16, enabled=self.training and (_HALVES or kind == "cuda")):
            found = self.look(pictures)
        found = found.float()  # places are finer than bfloat16
        weights = (self.sharpness * found.flatten(2)).softmax(-1)
        rows, columns = (torch.linspace(-1.0, 1.0, size, device=found.device) for size in found.shape[2:])
        grid = torch.stack(torch.meshgrid(columns, rows, indexing="xy"), -1).flatten(0, 1)
        return torch.cat([(weights @ grid).flatten(1), found.amax((2, 3)), found.mean((2, 3))], 1)


class Network(nn.Module):
    """Reads pictures of some cameras, and the robot's state.

    Args:
        heights: of the pictures, by camera [px].
        state: size of the robot's state.
        out: how many numbers it says.
    """

    mean: Tensor
    spread: Tensor

    def __init__(self, heights: Mapping[str, int], state: int, out: int) -> None:
        super().__init__()
        self.eyes = nn.ModuleDict({name: Eye(height) for name, height in heights.items()})
        self.say = nn.Sequential(
            nn.Linear(4 * _FEATURES * len(heights) + state, _HIDDEN),
            nn.ReLU(),
            nn.Linear(_HIDDEN, _HIDDEN),
            nn.ReLU(),
            nn.Linear(_HIDDEN, out),
        )
        self.register_buffer("mean", torch.zeros(state))
        self.register_buffer("spread", torch.ones(state))

    def forward(self, pictures: Mapping[str, Tensor], state: Tensor) -> Tensor:
        """Return what it says, (B, out).

        Args:
            pictures: by camera, (B, 3, height, width), from 0 to 1.
            state: of the robot, (B, s).
        """
        seen = [eye(2.0 * pictures[name] - 1.0) for name, eye in self.eyes.items()]
        return self.say(torch.cat([*seen, (state - self.mean) / self.spread], 1))


def _layer(before: int, after: int, size: int, stride: int, padding: int) -> tuple[nn.Module, ...]:
    return nn.Conv2d(before, after, size, stride, padding), nn.GroupNorm(8, after), nn.ReLU()
