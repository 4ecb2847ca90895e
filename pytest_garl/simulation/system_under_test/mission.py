"""The mission of the paper: fly to the given GPS position, find the marker, land on it."""

from __future__ import annotations

from pytest_garl.landing_system import Airframe, Mission
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placement import told_position_m
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.start import start_m

SEARCH_ALTITUDE_M = 10.0
"""Search height of the paper's published landing systems."""


def mission_for(
    scenario: Scenario,
    map: Map,
    airframe: Airframe,
    time_limit_s: float,
    *,
    error_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Mission:
    """Return the mission that the landing system gets before take-off.

    Its home is where its own navigation, which errs by ``error_m``, says that it is.
    """
    marker = scenario.task.marker
    x, y, z = start_m(scenario, map)
    dx, dy, dz = error_m
    return Mission(
        gps_position_m=told_position_m(scenario, map),
        home_m=(x + dx, y + dy, z + dz),
        search_altitude_m=SEARCH_ALTITUDE_M,
        marker_id=marker.id,
        marker_side_m=marker.side_m,
        marker_dictionary=marker.dictionary,
        nested_markers=marker.nested,
        camera=airframe.camera,
        time_limit_s=time_limit_s,
    )
