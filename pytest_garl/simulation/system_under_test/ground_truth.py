"""Ground truth for a reference pilot: the positions of the marker and of all objects."""

from __future__ import annotations

from dataclasses import dataclass

from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import ObjectType


@dataclass(frozen=True, slots=True, kw_only=True)
class TruthObject:
    """One dynamic object, exactly."""

    position_m: tuple[float, float, float]
    velocity_mps: tuple[float, float]
    type: ObjectType

    @property
    def top_m(self) -> float:
        """Height of its highest point above the ground."""
        return self.position_m[2] + self.type.low_m + self.type.height_m


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """The world at one camera frame; passed to systems that have ``observe_truth(truth)``."""

    marker_m: tuple[float, float]
    objects: tuple[TruthObject, ...]
    map: Map
