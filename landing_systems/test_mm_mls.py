"""MM-MLS must land on the marker, in time, hit nothing, and not give up needlessly."""

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


def test_completes_the_mission(landing: Landing) -> None:
    """It may give up only where nobody could land."""
    assert landing.completed or landing.excused
