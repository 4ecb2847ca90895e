import pytest
from my_landing import MyLandingSystem

pytestmark = pytest.mark.garl(system=MyLandingSystem, maps=["lawn"])


def test_lands_on_the_marker(landing):
    assert landing.distance_to_landing_m <= landing.limits.distance_m


def test_lands_in_time(landing):
    assert landing.time_to_landing_s <= landing.limits.time_s


def test_collides_with_nothing(landing):
    assert not landing.collisions


def test_completes_the_mission(landing):
    assert landing.completed or landing.excused
