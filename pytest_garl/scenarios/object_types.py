"""The types of dynamic objects: how fast, how big, how high, and where the numbers come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from pytest_garl.scenarios.bodies import Part, quaternion_of


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectType:
    """One kind of moving being.

    ``altitude_m`` is the height of the body's frame above the ground (0 for those that
    walk, the body's middle for those that fly); ``radius_m`` and ``height_m`` bound the parts.
    """

    name: str
    top_speed_mps: float
    acceleration_mps2: float
    radius_m: float
    height_m: float
    altitude_m: float
    parts: tuple[Part, ...]

    @property
    def bottom_m(self) -> float:
        """Height of the lowest point above the ground."""
        return self.altitude_m - self.height_m / 2 if self.altitude_m > 0 else 0.0

    @property
    def top_m(self) -> float:
        """Height of the highest point above the ground."""
        return self.bottom_m + self.height_m


def _limb(
    length_m: float,
    thickness_m: float,
    position_m: tuple[float, float, float],
    colour: tuple[int, int, int],
    pitch_rad: float = 0.0,
) -> Part:
    return Part(
        shape="cylinder",
        size_m=(thickness_m, thickness_m, length_m),
        position_m=position_m,
        rotation=quaternion_of(pitch_rad=pitch_rad),
        colour=colour,
    )


def _blob(
    size_m: tuple[float, float, float],
    position_m: tuple[float, float, float],
    colour: tuple[int, int, int],
) -> Part:
    return Part(shape="ellipsoid", size_m=size_m, position_m=position_m, colour=colour)


_JACKET, _TROUSERS, _SKIN, _HAIR = (178, 44, 40), (42, 50, 78), (214, 170, 140), (60, 42, 30)
_PERSON = (
    # Segment lengths roughly after Drillis and Contini (1966), stature 1.75 m.
    _limb(0.86, 0.15, (0.13, 0.10, 0.44), _TROUSERS, pitch_rad=-0.30),
    _limb(0.86, 0.15, (-0.13, -0.10, 0.44), _TROUSERS, pitch_rad=0.30),
    Part(shape="box", size_m=(0.24, 0.42, 0.60), position_m=(0.0, 0.0, 1.15), colour=_JACKET),
    _limb(0.62, 0.10, (-0.10, 0.26, 1.15), _JACKET, pitch_rad=0.35),
    _limb(0.62, 0.10, (0.10, -0.26, 1.15), _JACKET, pitch_rad=-0.35),
    _blob((0.20, 0.18, 0.25), (0.02, 0.0, 1.60), _SKIN),
    _blob((0.21, 0.19, 0.14), (-0.01, 0.0, 1.68), _HAIR),
)

_COAT, _MUZZLE = (134, 92, 54), (72, 50, 34)
_DOG = (
    _blob((0.62, 0.24, 0.26), (0.0, 0.0, 0.45), _COAT),
    _blob((0.24, 0.17, 0.18), (0.38, 0.0, 0.58), _COAT),
    _blob((0.16, 0.09, 0.09), (0.50, 0.0, 0.55), _MUZZLE),
    _limb(0.42, 0.07, (0.24, 0.08, 0.21), _COAT, pitch_rad=-0.2),
    _limb(0.42, 0.07, (0.20, -0.08, 0.21), _COAT, pitch_rad=0.2),
    _limb(0.42, 0.07, (-0.24, 0.08, 0.21), _COAT, pitch_rad=0.2),
    _limb(0.42, 0.07, (-0.20, -0.08, 0.21), _COAT, pitch_rad=-0.2),
    _limb(0.30, 0.04, (-0.40, 0.0, 0.56), _COAT, pitch_rad=-1.0),
)

_WHITE, _GREY, _BILL = (236, 236, 232), (150, 156, 164), (222, 178, 52)
_BIRD = (
    # A herring gull: 0.6 m long, 1.4 m wing span (Cramp and Simmons 1983).
    _blob((0.46, 0.16, 0.15), (0.0, 0.0, 0.0), _WHITE),
    _blob((0.13, 0.10, 0.10), (0.25, 0.0, 0.03), _WHITE),
    _blob((0.08, 0.03, 0.03), (0.33, 0.0, 0.02), _BILL),
    Part(shape="box", size_m=(0.20, 0.36, 0.03), position_m=(0.03, 0.24, 0.05), colour=_GREY),
    Part(shape="box", size_m=(0.20, 0.36, 0.03), position_m=(0.03, -0.24, 0.05), colour=_GREY),
    Part(shape="box", size_m=(0.13, 0.30, 0.02), position_m=(-0.03, 0.55, 0.04), colour=_GREY),
    Part(shape="box", size_m=(0.13, 0.30, 0.02), position_m=(-0.03, -0.55, 0.04), colour=_GREY),
    Part(shape="box", size_m=(0.16, 0.14, 0.02), position_m=(-0.27, 0.0, 0.01), colour=_WHITE),
)

OBJECT_TYPES: Mapping[str, ObjectType] = MappingProxyType(
    {
        kind.name: kind
        for kind in (
            ObjectType(
                name="person",
                # A jog: above the preferred walk-to-run transition of about 2 m/s
                # (Diedrich and Warren 1995); the paper's code moves persons at 3 m/s.
                top_speed_mps=3.0,
                # Engineering estimate: from standing to jogging within about a second.
                acceleration_mps2=3.0,
                radius_m=0.40,
                height_m=1.76,
                altitude_m=0.0,
                parts=_PERSON,
            ),
            ObjectType(
                name="dog",
                # A slow gallop of a medium dog; trot turns to gallop at some 3 to 4 m/s
                # (it scales with mass^0.2: Heglund and Taylor 1988).
                top_speed_mps=5.0,
                # Engineering estimate: well below a sprinting start, which pitching limits
                # (Williams et al. 2009).
                acceleration_mps2=5.0,
                radius_m=0.58,
                height_m=0.70,
                altitude_m=0.0,
                parts=_DOG,
            ),
            ObjectType(
                name="bird",
                # Slow flight of a gull; its cruise is about 12 to 13 m/s
                # (Alerstam et al. 2007), which no bird keeps up circling over a court.
                top_speed_mps=8.0,
                # Engineering estimate: a turn of 10 m radius at top speed.
                acceleration_mps2=6.0,
                radius_m=0.72,
                height_m=0.20,
                # Engineering estimate: above people, below roofs, where gulls beg.
                altitude_m=3.0,
                parts=_BIRD,
            ),
        )
    }
)
"""The paper's three types: a taller one on the ground, a low one, one in the air."""
