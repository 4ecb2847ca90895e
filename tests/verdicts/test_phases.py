from __future__ import annotations

import pytest

from pytest_garl.verdicts.evidence import Evidence
from tests.verdicts.flights import flight, step, track


def at(x: float, z: float, highest: float = 10.0, visible: float = 0.0) -> str:
    """Return the phase of a UAV that was ``highest`` and is ``x`` m off the marker, ``z`` m up."""
    path = track((0.0, -10.0, 0.0, highest), (10.0, x, 0.0, z))
    subject = flight("gave_up", (x, 0.0, z), uav=path, steps=(step(5.0, visible=visible),))
    return Evidence(subject).phase_at(10.0)


# Each threshold from both sides.


@pytest.mark.parametrize(("z", "name"), [(1.2, "last-metre"), (1.201, "descent")])
def test_last_metre_begins_at_a_height_of_1_2_m(z: float, name: str) -> None:
    assert at(0.0, z) == name


@pytest.mark.parametrize(("z", "name"), [(6.999, "descent"), (7.0, "approach")])
def test_descent_begins_below_seven_metres(z: float, name: str) -> None:
    assert at(0.0, z) == name


def phases(*samples: tuple[float, float]) -> list[str]:
    """Return the phase at each sample (time, height) of a flight over the marker."""
    path = track(*((time_s, 0.0, 0.0, z) for time_s, z in samples))
    subject = flight("gave_up", (0.0, 0.0, samples[-1][1]), uav=path, steps=())
    return [Evidence(subject).phase_at(time_s) for time_s, _ in samples]


@pytest.mark.parametrize(("top", "name"), [(6.499, "take-off"), (7.0, "approach")])
def test_a_climb_ends_at_seven_metres_at_the_latest(top: float, name: str) -> None:
    assert phases((0.0, 0.2), (2.0, 3.0), (4.0, top), (5.0, 10.0))[2] == name


@pytest.mark.parametrize("top", [2.0, 4.0, 6.5, 9.0])
def test_a_climb_ends_where_the_uav_turns_in(top: float) -> None:
    found = phases((0.0, 0.2), (1.0, 1.0), (3.0, top), (5.0, top - 0.6), (7.0, 1.2), (8.0, 0.3))
    lower = "descent" if top < 9.0 else "approach"
    assert found == ["take-off", "take-off", "approach", lower, "last-metre", "last-metre"]


@pytest.mark.parametrize(("sunk_m", "name"), [(0.49, "take-off"), (0.5, "approach")])
def test_bobbing_in_a_climb_is_no_turn(sunk_m: float, name: str) -> None:
    assert phases((0.0, 0.2), (2.0, 3.0), (3.0, 3.0 - sunk_m), (5.0, 10.0))[1] == name


@pytest.mark.parametrize(("level_s", "name"), [(1.9, "take-off"), (2.0, "approach")])
def test_a_climb_ends_where_the_uav_stays_for_two_seconds(level_s: float, name: str) -> None:
    assert phases((0.0, 0.2), (2.0, 4.0), (2.0 + level_s, 4.4))[1] == name


def test_a_pause_on_the_ground_or_in_the_climb_belongs_to_the_take_off() -> None:
    found = phases((0.0, 0.2), (9.0, 0.2), (10.0, 1.5), (20.0, 1.6), (24.0, 9.0))
    assert found == [*4 * ["take-off"], "approach"]


def test_a_hop_of_less_than_a_metre_is_no_flight() -> None:
    assert phases((0.0, 0.2), (1.0, 0.9), (2.0, 0.2), (4.0, 4.0))[:3] == 3 * ["take-off"]


@pytest.mark.parametrize("height", [2.0, 5.0, 9.0])
def test_a_uav_that_starts_in_the_air_never_takes_off(height: float) -> None:
    found = phases((0.0, height), (5.0, height), (9.0, 1.3), (10.0, 1.2))
    assert found == ["approach", "approach", "descent", "last-metre"]
    assert phases((0.0, height), (5.0, 10.0), (9.0, 6.9))[1:] == ["approach", "descent"]


def test_a_collision_without_a_recorded_contact_has_a_phase() -> None:
    assert Evidence(flight("collision", (0.0, 0.0, 1.0))).phase_at(30.0) == "last-metre"


def test_a_descent_begins_half_a_metre_below_a_low_search() -> None:
    found = phases((0.0, 4.0), (5.0, 3.501), (6.0, 3.499), (9.0, 3.9))
    assert found == ["approach", "approach", "descent", "approach"]


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
    assert Evidence(later).phase_at(10.0) == "transit"
