"""The types of dynamic objects: how fast, how big, how high, and where the numbers come from."""

from __future__ import annotations

from dataclasses import dataclass

from pytest_garl.scenarios.bodies import Part


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectType:
    """One kind of moving being.

    ``altitude_m`` is the height of the body's frame above the ground (0 for those that
    walk); ``radius_m`` and ``height_m`` bound the parts.
    """

    name: str
    top_speed_mps: float
    acceleration_mps2: float
    radius_m: float
    height_m: float
    altitude_m: float
    parts: tuple[Part, ...]
