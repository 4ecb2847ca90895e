"""The mission of the paper: fly to the given GPS position, find the marker, land on it."""

from __future__ import annotations

from pytest_garl.landing_system import Airframe, Mission
from pytest_garl.scenarios.placed import Placed

SEARCH_ALTITUDE_M = 10.0
"""Search height of the paper's published landing systems."""


def mission_for(
    placed: Placed,
    airframe: Airframe,
    time_limit_s: float,
    *,
    error_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Mission:
    """Return the mission that the landing system gets before take-off.

    Its home is where its own navigation, which errs by ``error_m``, says that it is.  A UAV that
    holds its place searches from there: a system that first climbs to another height would plan
    nothing.
    """
    marker, start = placed.scenario.task.marker, placed.scenario.task.start
    x, y, z = placed.start_m
    dx, dy, dz = error_m
    return Mission(
        gps_position_m=placed.told_m,
        home_m=(x + dx, y + dy, z + dz),
        search_altitude_m=start.height_m if start.holds else SEARCH_ALTITUDE_M,
        marker_id=marker.id,
        marker_side_m=marker.side_m,
        marker_dictionary=marker.dictionary,
        nested_markers=marker.nested,
        camera=airframe.camera,
        time_limit_s=time_limit_s,
    )
