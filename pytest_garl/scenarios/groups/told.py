"""The coordinate that the mission gives, which is not where the marker lies."""

from __future__ import annotations

from pytest_garl.scenarios.groups.parameter import Group, Parameter

GROUP = Group(
    name="told",
    meaning="the coordinate that the mission gives",
    parameters=(
        Parameter(
            name="surveyed",
            even=True,
            nominal=0.0,
            low=0.0,
            high=1.0,
            whole=True,
            meaning="whether the pad was surveyed: if so (1), the coordinate is the marker's and "
            "has an error; if not (0), it is the map's, wherever the marker lies",
            source="0 is the paper's world: the marker lies up to 7.5 m from the coordinate",
        ),
        Parameter(
            name="error_m",
            nominal=0.0,
            low=0.0,
            high=20.0,
            meaning="error of the coordinate",
            source="u-blox M8 data sheet: 2.5 m CEP; twice that for a pad surveyed with a phone",
        ),
        Parameter(
            name="towards_deg",
            even=True,
            nominal=0.0,
            low=0.0,
            high=360.0,
            meaning="direction of the error, counter-clockwise from east",
            source="any direction",
        ),
    ),
)
