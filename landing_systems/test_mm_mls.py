"""MM-MLS must land on the marker, in time, and hit nothing."""

from __future__ import annotations

import pytest

from landing_systems.mm_mls import MultiModuleLandingSystem
from pytest_garl import Landing

pytestmark = pytest.mark.garl(
    system=MultiModuleLandingSystem,
    maps=["court", "lawn"],
    files=["landing_systems/modules/detection_tphyolo/weights"],
)


def test_lands_on_the_marker(landing: Landing) -> None:
    """No farther from its centre than the limit."""
    assert landing.distance_to_landing_m <= landing.limits.distance_m


def test_lands_in_time(landing: Landing) -> None:
    """Within two minutes."""
    assert landing.time_to_landing_s <= landing.limits.time_s


def test_collides_with_nothing(landing: Landing) -> None:
    """No body but the ground, and that gently."""
    assert not landing.collisions
