"""Ground truth for a reference pilot: the positions of the marker and of all objects.

Only pilots of this package get it: a landing system must find the marker itself.  A method of
the same name in another class gets nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

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
    """The world at one camera frame."""

    marker_m: tuple[float, float]
    objects: tuple[TruthObject, ...]
    map: Map


class TruthPilot:
    """Base of the pilots of this package that get ground truth before each step."""

    def observe_truth(self, truth: Truth) -> None:
        """Take the truth of this moment."""
        raise NotImplementedError


class PilotWrapper:
    """Base of the classes of this package that pass calls on to another system, ``wrapped``."""

    wrapped: Any


def truth_pilot_of(system: Any) -> TruthPilot | None:
    """Return the pilot that gets ground truth, in a system or in what it wraps, or None."""
    # By the type: a landing system may have a property ``__class__``.
    kind = type(system)
    if not issubclass(kind, TruthPilot | PilotWrapper) or not is_own(kind):
        return None
    pilot: TruthPilot | None = (
        truth_pilot_of(system.wrapped) if issubclass(kind, PilotWrapper) else system
    )
    return pilot


def is_own(system: type) -> bool:
    """Whether this package defines a class."""
    return system.__module__.partition(".")[0] == __name__.partition(".")[0]
