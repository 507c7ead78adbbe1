"""The network that says from a picture where things are: an eye for each camera, which knows of no robot.

    f = convolutions of a picture, near and around                 (k, h, w), group norm
    u_o = Σ w_o (x, y),  g_o = Σ w_o f,  w_o = softmax(heat_o)     where the o-th thing is
    l_o = convolutions of the picture around u_o                   how it looks, from near and from farther
    y = u, MLP(u, g, l of all things, max f, mean f)               what is said: `encoder.py`

Spatial softmax: Finn et al., Deep spatial autoencoders for visuomotor learning, ICRA 2016.
Dilated convolutions: Yu & Koltun, Multi-scale context aggregation by dilated convolutions, ICLR 2016.
Windows of several scales: Mnih et al., Recurrent models of visual attention, NeurIPS 2014.
"""

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor, nn

_FEATURES = 32  # k, of an eye
_HIDDEN = 256
_SMALL = 160  # pictures up to this height are halved once less [px]
_LARGE = 300  # from this height on an eye has half the channels [px]
_WINDOW = 32  # side of what is looked at closely [px]
_SCALES = (1, 4)  # by which the picture is made smaller before
_LOOKS = 64  # numbers that say how a thing looks
_SPREAD = (1, 2, 4)  # of the taps of convolutions, one after the other
_HALVES = bool(getattr(torch.cpu, "get_capabilities", dict)().get("amx_bf16"))  # half the time


class Eye(nn.Module):
    """Looks at the pictures of one camera.

    Args:
        height: of its pictures [px].
        sizes: how many numbers it says of each thing; where it is in the picture first.
    """

    def __init__(self, height: int, sizes: Sequence[int]) -> None:
        super().__init__()
        width = 16 if height > _LARGE else 32
        stem = (5, 2, 2) if height <= _SMALL else (7, 4, 3)
        wide = [_layer(2 * width, 2 * width, 3, 1, by, by) for by in _SPREAD]
        self.near = nn.Sequential(*_layer(3, width, *stem), *_layer(width, 2 * width, 3, 2, 1))
        self.around = nn.Sequential(
            *_layer(2 * width, 2 * width, 3, 2, 1), *(part for layer in wide for part in layer)
        )
        self.both = nn.Sequential(*_layer(4 * width, _FEATURES, 1, 1, 0))
        self.heat = nn.Conv2d(_FEATURES, len(sizes), 1)
        self.closely = nn.Sequential(
            *_layer(3 * len(_SCALES), 32, 3, 2, 1),
            *_layer(32, 64, 3, 2, 1),
            *_layer(64, 64, 3, 2, 1),
            nn.Flatten(),
            nn.Linear(64 * (_WINDOW // 8) ** 2, _LOOKS),
            nn.ReLU(),
        )
        self.say = nn.Sequential(
            nn.Linear(len(sizes) * (_FEATURES + _LOOKS + 2) + 2 * _FEATURES, _HIDDEN),
            nn.ReLU(),
            nn.Linear(_HIDDEN, _HIDDEN),
            nn.ReLU(),
            nn.Linear(_HIDDEN, sum(sizes)),
        )
        starts = torch.tensor([0, *sizes[:-1]]).cumsum(0)
        self._places = torch.stack([starts, starts + 1], 1).flatten()

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Return what it says, (B, Σ sizes), and log w, (B, o, h, w), of pictures from −1 to 1, (B, 3, …)."""
        kind = pictures.device.type
        with torch.autocast(kind, torch.bfloat16, enabled=self.training and (_HALVES or kind == "cuda")):
            near = self.near(pictures)
            around = nn.functional.interpolate(self.around(near), near.shape[2:], mode="bilinear")
            found = self.both(torch.cat([near, around], 1))
        found = found.float()  # places are finer than bfloat16
        heat = self.heat(found).flatten(2).log_softmax(-1)
        weights = heat.exp()
        rows, columns = (
            (2 * torch.arange(cells, device=found.device) + 1) / cells - 1 for cells in found.shape[2:]
        )
        grid = torch.stack(torch.meshgrid(columns, rows, indexing="xy"), -1).flatten(0, 1)
        at = weights @ grid
        near = self.closely(windows(pictures, at.detach()))
        looks = (weights @ found.flatten(2).transpose(1, 2)).flatten(1)
        places, near = at.flatten(1), near.view(len(at), -1)
        said = self.say(torch.cat([places, looks, near, found.amax((2, 3)), found.mean((2, 3))], 1))
        return said.index_copy(1, self._places.to(said.device), places), heat.unflatten(2, found.shape[2:])


class Network(nn.Module):
    """Reads pictures of some cameras.

    Args:
        heights: of the pictures, by camera [px].
        sizes: how many numbers it says of each thing.
    """

    def __init__(self, heights: Mapping[str, int], sizes: Sequence[int]) -> None:
        super().__init__()
        self.eyes = nn.ModuleDict({name: Eye(height, sizes) for name, height in heights.items()})

    def forward(self, pictures: Mapping[str, Tensor]) -> Tensor:
        """Return what it says of pictures from 0 to 1, (B, 3, height, width); (B, cameras, Σ sizes)."""
        return torch.stack([said for said, _ in self.look(pictures)], 1)

    def look(self, pictures: Mapping[str, Tensor]) -> list[tuple[Tensor, Tensor]]:
        """Return what each eye says of pictures as of `forward`, and log w."""
        return [eye(2.0 * pictures[name] - 1.0) for name, eye in self.eyes.items()]


def windows(pictures: Tensor, places: Tensor) -> Tensor:
    """Return what is around places of pictures, (B · o, 3 · scales, window, window).

    Args:
        pictures: (B, 3, height, width).
        places: u, v, (B, o, 2).
    """
    steps = torch.arange(_WINDOW, device=places.device) - (_WINDOW - 1) / 2
    around = torch.stack(torch.meshgrid(steps, steps, indexing="xy"), -1)
    side = torch.tensor(pictures.shape[:1:-1], device=places.device)
    found = []
    for scale in _SCALES:
        smaller = nn.functional.avg_pool2d(pictures, scale, ceil_mode=True)
        at = places[:, :, None, None] + around * (2 * scale / side)
        each = nn.functional.grid_sample(smaller, at.flatten(1, 2), align_corners=False)
        found.append(each.unflatten(2, (-1, _WINDOW)).movedim(2, 1).flatten(0, 1))
    return torch.cat(found, 1)


def _layer(
    before: int, after: int, size: int, stride: int, padding: int, spread: int = 1
) -> tuple[nn.Module, ...]:
    convolution = nn.Conv2d(before, after, size, stride, padding, spread)
    return convolution, nn.GroupNorm(8, after), nn.ReLU()
