"""Wind: a mean with its direction, and turbulence."""

from __future__ import annotations

from pytest_garl.scenarios.groups.parameter import Group, Parameter

GROUP = Group(
    name="wind",
    meaning="wind over the pad",
    parameters=(
        Parameter(
            name="mean_mps",
            nominal=0.0,
            low=0.0,
            high=15.0,
            meaning="mean speed at a height of 6 m",
            source="DJI Matrice 100 data sheet: resists 10 m/s, gusts included",
        ),
        Parameter(
            name="towards_deg",
            even=True,
            nominal=0.0,
            low=0.0,
            high=360.0,
            meaning="direction in which the air moves (0: east, 90: north)",
            source="any direction",
        ),
        Parameter(
            name="turbulence",
            nominal=0.0,
            low=0.0,
            high=1.5,
            meaning="intensity of gusts as a factor on MIL-F-8785C at low altitude",
            source="MIL-F-8785C: 1 is what the standard expects at that mean",
        ),
    ),
)
