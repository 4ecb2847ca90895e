"""The types of dynamic objects: how fast, how big, how high, and where the numbers come from."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from pytest_garl.scenarios.bodies import Part, quaternion_of


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectType:
    """One kind of moving being.

    It moves in the direction that it faces.  ``acceleration_mps2`` and ``braking_mps2`` bound how
    fast its speed changes.  It turns on the spot at up to ``turn_rate_radps``, and on the move no
    faster than ``lateral_mps2`` allows.  ``least_speed_mps`` is the speed below which it falls from
    the air, 0 for those that walk.  It runs faster than ``sustained_speed_mps`` only in bursts:
    for ``burst_m`` metres more than it goes at that speed in the same time.  It climbs and dives at
    ``climb_mps`` and ``dive_mps`` at most.  It leaps ``leap_m`` high.

    ``altitude_m`` is the height of the body's frame above the ground, unless the scenario gives
    another (0 for those that walk, the body's middle for those that fly); ``radius_m`` and
    ``height_m`` bound the parts.
    """

    name: str
    top_speed_mps: float
    acceleration_mps2: float
    braking_mps2: float
    lateral_mps2: float
    turn_rate_radps: float
    radius_m: float
    height_m: float
    altitude_m: float
    parts: tuple[Part, ...]
    climb_mps: float = 0.0
    dive_mps: float = 0.0
    least_speed_mps: float = 0.0
    sustained_speed_mps: float = math.inf
    burst_m: float = 0.0
    leap_m: float = 0.0

    @property
    def flies(self) -> bool:
        """Whether it flies; then it never stops in the air."""
        return self.least_speed_mps > 0

    @property
    def low_m(self) -> float:
        """Height of the lowest point above the body's frame."""
        return -self.height_m / 2 if self.flies else 0.0

    @property
    def bottom_m(self) -> float:
        """Height of the lowest point above the ground at the type's own altitude."""
        return self.altitude_m + self.low_m

    @property
    def top_m(self) -> float:
        """Height of the highest point above the ground at the type's own altitude."""
        return self.bottom_m + self.height_m

    @property
    def sitting_m(self) -> float:
        """Height of the body's frame above the ground while it sits or stands there."""
        return -self.low_m

    @property
    def turn_radius_m(self) -> float:
        """Radius of the narrowest turn that it can make without stopping."""
        return self.least_speed_mps**2 / self.lateral_mps2

    def speed_mps(self, share: float) -> float:
        """Return the speed for a share from 0 (it stays where it starts) to 1 (its top speed)."""
        low = self.least_speed_mps if share > 0 else 0.0
        return low + share * (self.top_speed_mps - low)

    def share_of(self, speed_mps: float) -> float:
        """Return the share that gives a speed; slower than it can move is its least speed."""
        if speed_mps <= 0:
            return 0.0
        low = self.least_speed_mps
        share = (speed_mps - low) / (self.top_speed_mps - low)
        return min(1.0, max(_LEAST_SHARE if self.flies else 0.0, share))


BIRD_HEIGHTS_M = (1.0, 15.0)
"""Heights at which a scenario may let birds fly: their wings clear the ground, and an approach at
the paper's 10 m is met from below and from above."""


_LEAST_SHARE = 1e-6
"""The share of a bird at its least speed: at 0 it sits."""


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

_STATURE = 1.16 / 1.75
"""A child of six years to the adult: WHO growth reference (2007), median of boys, 1.16 m."""


def _smaller(part: Part, share: float) -> Part:
    (length, width, height), (x, y, z) = part.size_m, part.position_m
    return dataclasses.replace(
        part,
        size_m=(share * length, share * width, share * height),
        position_m=(share * x, share * y, share * z),
        colour=_CHILDS_JACKET if part.colour == _JACKET else part.colour,
    )


_CHILDS_JACKET = (64, 120, 62)
_CHILD = tuple(_smaller(part, _STATURE) for part in _PERSON)

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
                # Free walkers reach 1.54 m/s with a relaxation time of 0.66 s (Liu et al. 2017):
                # they start with 2.3 m/s².
                acceleration_mps2=2.3,
                # Walkers slow down from about 1.3 m/s within 0.58 s (Tavana et al. 2024).
                braking_mps2=2.3,
                # Changing the direction takes longer than starting (Liu et al. 2017), so it is no
                # harder: a turn of 0.9 m radius at 1.4 m/s, and of 4 m radius at 3 m/s.
                lateral_mps2=2.3,
                # Engineering estimate: half a turn on the spot in a second.
                turn_rate_radps=math.pi,
                radius_m=0.40,
                height_m=1.76,
                altitude_m=0.0,
                parts=_PERSON,
            ),
            ObjectType(
                name="child",
                # Engineering estimate: a child of six runs as fast as an adult sprints slowly.
                top_speed_mps=4.0,
                # As an adult: it is lighter and has shorter legs.
                acceleration_mps2=2.3,
                braking_mps2=2.3,
                lateral_mps2=2.3,
                turn_rate_radps=math.pi,
                radius_m=0.28,
                height_m=1.17,
                altitude_m=0.0,
                parts=_CHILD,
            ),
            ObjectType(
                name="dog",
                # A gallop of a medium dog, half of a racing greyhound's 16 m/s
                # (Usherwood and Wilson 2005).
                top_speed_mps=8.0,
                # A trot turns to a gallop at some 3 to 4 m/s (it scales with mass^0.2: Heglund and
                # Taylor 1988).  Engineering estimate: a dog plays at full gallop for five seconds.
                # Speed above what can be kept up draws on a reserve of distance that slower
                # running fills again: the critical-speed model (Hughson et al. 1984).
                sustained_speed_mps=4.0,
                burst_m=20.0,
                # Engineering estimate: well below a sprinting start, which pitching limits
                # (Williams et al. 2009).
                acceleration_mps2=5.0,
                braking_mps2=6.0,
                # Half of what greyhounds stand on a bend, where the force on their legs rises by
                # 65 %, which is 1.3 g to the side (Usherwood and Wilson 2005).
                lateral_mps2=6.4,
                # Engineering estimate: once around on the spot in a second.
                turn_rate_radps=2 * math.pi,
                # Dogs of its height clear bars of 0.55 to 0.6 m in agility (regulations of the
                # FCI); reports of dogs that leap at a UAV tell of 1 to 1.5 m.
                leap_m=1.0,
                radius_m=0.58,
                height_m=0.70,
                altitude_m=0.0,
                parts=_DOG,
            ),
            ObjectType(
                name="bird",
                # Cruise of a herring gull: 12.8 m/s (Alerstam et al. 2007).
                top_speed_mps=13.0,
                # The stall of a herring gull of 1 kg and 0.2 m² (Pennycuick 2008) with a largest
                # lift coefficient of 1.6 (Tucker and Heine 1990): sqrt(2 m g / (rho S C)) = 7.1.
                least_speed_mps=7.0,
                # Birds of the gull's mass climb with 1 to 2 m/s (Hedenström and Alerstam 1992).
                climb_mps=1.5,
                # Engineering estimate: a dive of 40 degrees at 13 m/s, far below the stoop of a
                # falcon.
                dive_mps=8.0,
                # Engineering estimates: flapping harder, and spreading wings and tail to brake.
                acceleration_mps2=3.0,
                braking_mps2=5.0,
                # g tan(40°): engineering estimate of the bank.  A turn at least speed has a radius
                # of 6 m.
                lateral_mps2=8.2,
                turn_rate_radps=2 * math.pi,
                radius_m=0.72,
                height_m=0.20,
                # Engineering estimate: above people, below roofs, where gulls beg.
                altitude_m=3.0,
                parts=_BIRD,
            ),
        )
    }
)
"""The paper's three types, a taller one on the ground, a low one, one in the air; and children."""
