from __future__ import annotations

import pytest

from pytest_garl.verdicts.phases import landing_phase
from tests.verdicts.flights import flight, step, track


def at(x: float, z: float, highest: float = 10.0, visible: float = 0.0) -> str:
    """Return the phase of a UAV that was ``highest`` and is ``x`` m off the marker, ``z`` m up."""
    path = track((0.0, -10.0, 0.0, highest), (10.0, x, 0.0, z))
    subject = flight("gave_up", (x, 0.0, z), uav=path, steps=(step(5.0, visible=visible),))
    return landing_phase(subject, 10.0)


# Each threshold from both sides.


@pytest.mark.parametrize(("z", "name"), [(1.2, "last-metre"), (1.201, "descent")])
def test_last_metre_begins_at_a_height_of_1_2_m(z: float, name: str) -> None:
    assert at(0.0, z) == name


@pytest.mark.parametrize(("z", "name"), [(6.999, "descent"), (7.0, "approach")])
def test_descent_begins_below_seven_metres(z: float, name: str) -> None:
    assert at(0.0, z) == name


@pytest.mark.parametrize(("highest", "name"), [(6.999, "take-off"), (7.0, "descent")])
def test_take_off_ends_at_seven_metres(highest: float, name: str) -> None:
    assert at(0.0, 5.0, highest=highest) == name


@pytest.mark.parametrize(("x", "name"), [(2.499, "approach"), (2.5, "transit")])
def test_approach_is_nearer_than_2_5_m_to_the_marker(x: float, name: str) -> None:
    assert at(x, 8.0) == name


@pytest.mark.parametrize(("visible", "name"), [(0.0, "transit"), (0.001, "search")])
def test_transit_ends_when_the_marker_comes_into_view(visible: float, name: str) -> None:
    assert at(5.0, 8.0, visible=visible) == name
    later = flight(
        "gave_up",
        (5.0, 0.0, 8.0),
        uav=track((0.0, -10.0, 0.0, 10.0), (10.0, 5.0, 0.0, 8.0)),
        steps=(step(10.1, visible=1.0),),
    )
    assert landing_phase(later, 10.0) == "transit"
