from __future__ import annotations

from math import inf

from pytest_garl.flight.landing_phases import LandingPhases


def began(*heights_m: float) -> tuple[float, ...]:
    """Return when each phase began if the UAV is at these heights, a second apart."""
    phases = LandingPhases()
    for second, height in enumerate(heights_m):
        phases.update(float(second), height)
    return phases.began_s


def test_phases_begin_when_the_uav_sinks_past_their_heights() -> None:
    assert began(0.0, 5.0, 10.0, 9.0, 7.9, 4.0, 2.9, 1.0, 0.0) == (0.0, 4.0, 6.0, 8.0)


def test_a_take_off_begins_no_phase() -> None:
    assert began(0.0, 2.9, 3.0, 7.9, 8.0, 10.0) == (0.0, inf, inf, inf)


def test_a_uav_that_stays_low_passes_the_higher_phase_with_the_lower_one() -> None:
    assert began(5.0, 4.0, 2.9) == (0.0, 2.0, 2.0, inf)


def test_a_phase_begins_once() -> None:
    assert began(10.0, 7.0, 10.0, 7.0)[1] == 1.0
