"""What an export is made of: a flight, the limits that judge it, and the place if it is known."""

from __future__ import annotations

from dataclasses import dataclass

from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.placed import Placed
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, Limits


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where a flight of the built-in simulator was flown, and with which camera.

    ``camera`` is the one that the landing system declares, None if its pictures cannot be drawn
    again.
    """

    placed: Placed
    camera: Camera | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Export:
    """A flight to export; ``place`` is None for a flight of a simulator of the user's own.

    ``name`` says which flight it is, ``signature`` what it violates, empty if nothing.
    """

    name: str
    flight: Flight
    signature: str = ""
    limits: Limits = DEFAULT_LIMITS
    place: Place | None = None
