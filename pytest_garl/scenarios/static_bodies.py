"""The kinds of static bodies that ``[[bodies]]`` of a map can name; each is built from parts."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

from pytest_garl.scenarios.bodies import Part, quaternion_of

Parts = tuple[Part, ...]
_BARK, _LEAVES, _WOOD, _STEEL = (96, 74, 56), (58, 92, 44), (142, 104, 66), (92, 96, 100)
_GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))


def tree(*, height_m: float = 5.0, crown_m: float = 3.0, branches: int = 5) -> Parts:
    """Return a broad-leaved tree: a trunk, and branches with leaves at their ends.

    ``crown_m`` is the crown's diameter.  Branches leave the trunk in a golden-angle
    spiral (phyllotaxis) at 45 % to 75 % of the height and rise at about 30 degrees.
    """
    parts = [
        Part(
            shape="cylinder",
            size_m=(0.06 * height_m, 0.06 * height_m, 0.8 * height_m),
            position_m=(0.0, 0.0, 0.4 * height_m),
            colour=_BARK,
        )
    ]
    for index in range(branches):
        yaw = index * _GOLDEN_ANGLE
        base = height_m * (0.45 + 0.30 * index / max(1, branches - 1))
        length = crown_m / 2 * 0.9
        reach, rise = length * math.cos(math.pi / 6), length * math.sin(math.pi / 6)
        middle = (reach / 2 * math.cos(yaw), reach / 2 * math.sin(yaw), base + rise / 2)
        parts.append(
            Part(
                shape="cylinder",
                size_m=(0.09, 0.09, length),
                position_m=middle,
                rotation=quaternion_of(pitch_rad=math.pi / 3, yaw_rad=yaw),
                colour=_BARK,
            )
        )
        leaves_m = crown_m * 0.30
        parts.append(
            Part(
                shape="ellipsoid",
                size_m=(leaves_m, leaves_m, 0.7 * leaves_m),
                position_m=(reach * math.cos(yaw), reach * math.sin(yaw), base + rise),
                colour=_LEAVES,
            )
        )
    top_m = (0.55 * crown_m, 0.55 * crown_m, 0.35 * height_m)
    parts.append(
        Part(
            shape="ellipsoid", size_m=top_m, position_m=(0.0, 0.0, 0.85 * height_m), colour=_LEAVES
        )
    )
    return tuple(parts)


def bench(*, length_m: float = 1.8) -> Parts:
    """Return a park bench along its own y axis: seat 0.45 m high, backrest, two supports."""
    support_y = length_m / 2 - 0.2
    return (
        Part(
            shape="box",
            size_m=(0.45, length_m, 0.06),
            position_m=(0.0, 0.0, 0.45),
            colour=_WOOD,
        ),
        Part(
            shape="box",
            size_m=(0.05, length_m, 0.40),
            position_m=(-0.22, 0.0, 0.72),
            colour=_WOOD,
        ),
        *(
            Part(shape="box", size_m=(0.40, 0.06, 0.44), position_m=(0.0, y, 0.22), colour=_STEEL)
            for y in (-support_y, support_y)
        ),
    )


def hoop() -> Parts:
    """Return a basketball hoop facing +x: backboard 1.8 by 1.05 m, ring 3.05 m high (FIBA)."""
    segments = 8
    ring = tuple(
        Part(
            shape="box",
            size_m=(0.02, 0.19, 0.02),
            position_m=(
                1.575 + 0.225 * math.cos(2 * math.pi * index / segments),
                0.225 * math.sin(2 * math.pi * index / segments),
                3.05,
            ),
            rotation=quaternion_of(yaw_rad=2 * math.pi * index / segments),
            colour=(206, 88, 36),
        )
        for index in range(segments)
    )
    return (
        Part(
            shape="cylinder",
            size_m=(0.16, 0.16, 3.2),
            position_m=(0.0, 0.0, 1.6),
            colour=_STEEL,
        ),
        Part(shape="box", size_m=(1.2, 0.10, 0.10), position_m=(0.6, 0.0, 3.2), colour=_STEEL),
        Part(
            shape="box",
            size_m=(0.05, 1.80, 1.05),
            position_m=(1.2, 0.0, 3.425),
            colour=(228, 228, 228),
        ),
        *ring,
    )


def post(*, height_m: float = 4.0, diameter_m: float = 0.12) -> Parts:
    """Return an upright post."""
    return (
        Part(
            shape="cylinder",
            size_m=(diameter_m, diameter_m, height_m),
            position_m=(0.0, 0.0, height_m / 2),
            colour=_STEEL,
        ),
    )


def box(*, x_m: float = 1.0, y_m: float = 1.0, height_m: float = 1.0) -> Parts:
    """Return a plain box that stands on the ground; also a wall or a kerb."""
    return (
        Part(
            shape="box",
            size_m=(x_m, y_m, height_m),
            position_m=(0.0, 0.0, height_m / 2),
            colour=(150, 146, 140),
        ),
    )


STATIC_BODIES: Mapping[str, Callable[..., Parts]] = MappingProxyType(
    {"tree": tree, "bench": bench, "hoop": hoop, "post": post, "box": box}
)
"""The kinds of static bodies that a map can name, with their keyword arguments."""
