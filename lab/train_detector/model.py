"""The network: a small YOLO with transformer blocks, CBAM and a head for small markers.

Training needs PyTorch and this module; flying needs neither (see ``detector.py``).
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from landing_systems.modules.detection_tphyolo.decoding import CHANNELS

_PRIOR = -4.6
"""Initial logit of objectness: one cell in a hundred, so that training does not begin with a
flood of false positives (Lin et al. 2017, focal loss)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Widths:
    """Channels after the stem and at strides 4, 8, 16 and 32, and of the neck.

    Chosen by the time that a 320x240 frame takes on one core.
    """

    stem: int = 8
    backbone: tuple[int, int, int, int] = (16, 32, 64, 80)
    neck: tuple[int, int, int, int] = (16, 32, 48, 64)
    heads: int = 2


class Convolution(nn.Sequential):
    """3x3 or 1x1 convolution, batch normalisation, ReLU."""

    def __init__(self, inside: int, outside: int, size: int = 3, stride: int = 1) -> None:
        super().__init__(
            nn.Conv2d(inside, outside, size, stride, size // 2, bias=False),
            nn.BatchNorm2d(outside),
            nn.ReLU(inplace=True),
        )


class Projection(nn.Sequential):
    """1x1 convolution and batch normalisation: a linear layer for each cell."""

    def __init__(self, inside: int, outside: int) -> None:
        super().__init__(nn.Conv2d(inside, outside, 1, bias=False), nn.BatchNorm2d(outside))


class Bottleneck(nn.Module):
    """1x1 to half the channels, 3x3 back, and a shortcut: YOLOv5's residual block."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.squeeze = Convolution(width, width // 2, 1)
        self.expand = Convolution(width // 2, width)

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, width, H, W) to the same shape."""
        result: Tensor = x + self.expand(self.squeeze(x))
        return result


class TransformerBlock(nn.Module):
    """A transformer encoder layer over the cells of a feature map (Vaswani et al. 2017).

    Batch normalisation, which costs nothing when flying, takes the place of the layer's
    normalisation.  No position is encoded: the convolutions before it have padding and know
    theirs, and the number of cells may differ between training and flying.
    """

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.query = Projection(width, width)
        self.key = Projection(width, width)
        self.value = Projection(width, width)
        self.out = Projection(width, width)
        self.feed = nn.Sequential(Convolution(width, 2 * width, 1), Projection(2 * width, width))

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, width, H, W) to the same shape."""
        count, width, rows, columns = x.shape
        split = (count, self.heads, width // self.heads, rows * columns)
        query = self.query(x).reshape(split).transpose(2, 3)
        key = self.key(x).reshape(split)
        value = self.value(x).reshape(split).transpose(2, 3)
        weights = ((query @ key) * (width // self.heads) ** -0.5).softmax(3)
        seen = (weights @ value).transpose(2, 3).reshape(count, width, rows, columns)
        x = x + self.out(seen)
        result: Tensor = x + self.feed(x)
        return result


class Cbam(nn.Module):
    """Convolutional block attention: which channels, then which places (Woo et al. 2018)."""

    def __init__(self, width: int, reduction: int = 8) -> None:
        super().__init__()
        self.channels = nn.Sequential(
            nn.Conv2d(width, max(4, width // reduction), 1),
            nn.ReLU(inplace=True),
            nn.Conv2d(max(4, width // reduction), width, 1),
        )
        self.places = nn.Conv2d(2, 1, 7, padding=3)

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, width, H, W) to the same shape."""
        mean, most = x.mean((2, 3), keepdim=True), x.amax((2, 3), keepdim=True)
        x = x * torch.sigmoid(self.channels(mean) + self.channels(most))
        summary = torch.cat([x.mean(1, keepdim=True), x.amax(1, keepdim=True)], 1)
        return x * torch.sigmoid(self.places(summary))


class TphYolo(nn.Module):
    """Backbone, neck and four heads; see the package's docstring for what is reproduced.

    Takes RGB in [0, 1], (N, 3, H, W) with H and W multiples of 8; gives (N, 5, cells):
    all cells of stride 4 row by row, then of 8, 16 and 32; see ``decoding.decode`` for what
    the numbers mean.
    """

    def __init__(self, widths: Widths | None = None) -> None:
        super().__init__()
        w = widths or Widths()
        b2, b3, b4, b5 = w.backbone
        n2, n3, n4, n5 = w.neck
        self.stem = Convolution(3, w.stem, 3, 2)
        self.stage2 = nn.Sequential(Convolution(w.stem, b2, 3, 2), Bottleneck(b2))
        self.stage3 = nn.Sequential(Convolution(b2, b3, 3, 2), Bottleneck(b3), Bottleneck(b3))
        self.stage4 = nn.Sequential(Convolution(b3, b4, 3, 2), Bottleneck(b4), Bottleneck(b4))
        self.stage5 = nn.Sequential(Convolution(b4, b5, 3, 2), TransformerBlock(b5, w.heads))
        self.top5 = Convolution(b5, n5, 1)
        self.top4 = Convolution(b4 + n5, n4, 1)
        self.top3 = Convolution(b3 + n4, n3, 1)
        self.top2 = Convolution(b2 + n3, n2, 1)
        self.halve = nn.MaxPool2d(2, ceil_mode=True)
        self.out2 = Bottleneck(n2)
        self.out3 = nn.Sequential(Convolution(n3 + n2, n3, 1), Bottleneck(n3), Cbam(n3))
        self.out4 = nn.Sequential(
            Convolution(n4 + n3, n4, 1), TransformerBlock(n4, w.heads), Cbam(n4)
        )
        self.out5 = nn.Sequential(
            Convolution(n5 + n4, n5, 1), TransformerBlock(n5, w.heads), Cbam(n5)
        )
        self.heads = nn.ModuleList(nn.Conv2d(width, CHANNELS, 1) for width in w.neck)
        for head in self.heads:
            assert isinstance(head, nn.Conv2d)
            assert head.bias is not None
            nn.init.normal_(head.weight, std=0.01)
            nn.init.zeros_(head.bias)
            nn.init.constant_(head.bias[4], _PRIOR)

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, 3, H, W) to (N, 5, cells)."""
        s2 = self.stage2(self.stem(x))
        s3 = self.stage3(s2)
        s4 = self.stage4(s3)
        t5 = self.top5(self.stage5(s4))
        t4 = self.top4(torch.cat([s4, _enlarged(t5, s4)], 1))
        t3 = self.top3(torch.cat([s3, _enlarged(t4, s3)], 1))
        t2 = self.top2(torch.cat([s2, _enlarged(t3, s2)], 1))
        p2 = self.out2(t2)
        p3 = self.out3(torch.cat([t3, self.halve(p2)], 1))
        p4 = self.out4(torch.cat([t4, self.halve(p3)], 1))
        p5 = self.out5(torch.cat([t5, self.halve(p4)], 1))
        found = [head(p) for head, p in zip(self.heads, (p2, p3, p4, p5), strict=True)]
        return torch.cat([each.flatten(2) for each in found], 2)


def _enlarged(x: Tensor, like: Tensor) -> Tensor:
    """Double (N, C, h, w) and cut it to the size of ``like``, which may be one less."""
    doubled = nn.functional.interpolate(x, scale_factor=2.0, mode="nearest")
    return doubled[:, :, : like.shape[2], : like.shape[3]]


def parameter_count(model: nn.Module) -> int:
    """Count the numbers that are learned."""
    return sum(each.numel() for each in model.parameters())


def fused(model: nn.Module) -> nn.Module:
    """Return a copy for inference in which batch normalisation is part of the convolutions."""
    result = copy.deepcopy(model).eval()
    for module in result.modules():
        if isinstance(module, (Convolution, Projection)):
            convolution, norm = module[0], module[1]
            assert isinstance(convolution, nn.Conv2d)
            assert isinstance(norm, nn.BatchNorm2d)
            module[0] = torch.nn.utils.fuse_conv_bn_eval(convolution, norm)
            module[1] = nn.Identity()
    return result


def follow(averaged: nn.Module, model: nn.Module, step: int, decay: float) -> None:
    """Move ``averaged`` towards ``model``, in the first steps faster than ``decay`` says."""
    decay = min(decay, (1 + step) / (10 + step))
    states = averaged.state_dict(), model.state_dict()
    with torch.no_grad():
        for name, kept in states[0].items():
            if kept.dtype.is_floating_point:
                kept.lerp_(states[1][name], 1 - decay)
            else:
                kept.copy_(states[1][name])
