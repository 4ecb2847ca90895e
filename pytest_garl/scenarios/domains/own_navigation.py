"""What a vehicle's own navigation leaves of the navigation errors in a domain."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from pytest_garl.errors import ScenarioError
from pytest_garl.landing_system import NavigationKind
from pytest_garl.scenarios.domains.domain import Domain
from pytest_garl.scenarios.groups import QUANTITIES

RTK_LIMITS: Mapping[str, float] = {
    "navigation.position_m": 0.02,
    "navigation.height_m": 0.05,
    "jump.distance_m": 1.0,
}
"""Largest errors of a receiver with corrections.

u-blox ZED-F9P data sheet: 1 cm and 1 ppm CEP with a fixed solution, and the height is worse by a
half to two (PX4 and surveyors' guides: 1 to 3 cm, height 2 to 5 cm); without corrections the
position jumps by about a metre (u-blox support, "When my rover loses RTK fix").  Corrections change
nothing about heading and tilt, which come from the compass and the inertial unit.
"""
_ERRING = ("navigation", "jump")


def within(domain: Domain, navigation: NavigationKind) -> Domain:
    """Return the domain with the navigation errors that such navigation has.

    Raises ScenarioError if the domain has only larger ones.
    """
    if navigation == "gnss" or domain.paper:
        return domain
    ranges = []
    for key, low, high in domain.ranges:
        if key.partition(".")[0] not in _ERRING:
            ranges.append((key, low, high))
            continue
        nominal = QUANTITIES[key].nominal
        # Directions and times say how something errs, not that it does.
        errs = not QUANTITIES[key].even
        if navigation == "ideal":
            if errs and not low <= nominal <= high:
                raise _contradiction(domain, navigation, key, low, nominal)
            continue
        most = RTK_LIMITS.get(key, high)
        if low > most:
            raise _contradiction(domain, navigation, key, low, most)
        ranges.append((key, low, min(high, most)))
    return dataclasses.replace(domain, ranges=tuple(ranges))


def _contradiction(
    domain: Domain, navigation: NavigationKind, key: str, low: float, most: float
) -> ScenarioError:
    return ScenarioError(
        f"domain {domain.name!r}: {key} begins at {low:g}, but a vehicle with "
        f"Airframe(navigation={navigation!r}) has at most {most:g}; expected a lower range, or "
        "another navigation"
    )
