"""Pad: how the marker lies, how worn it is, and how near obstacles are."""

from __future__ import annotations

from pytest_garl.scenarios.groups.parameter import Group, Parameter

CLEARANCE = Parameter(
    name="clearance_m",
    nominal=1.3,
    low=0.6,
    high=1.3,
    meaning="least distance from the marker's middle to obstacles, seen from above, that the "
    "choice of its place keeps; 1.3: its corners are 0.25 m away from them, whatever its size",
    source="0.6 m: half of a UAV of 1 m and 0.1 m; ISO 34503 leaves the pad's surroundings to the "
    "user",
)
GROUP = Group(
    name="pad",
    meaning="a marker that lies turned, worn or near obstacles",
    parameters=(
        Parameter(
            name="yaw_deg",
            even=True,
            nominal=0.0,
            low=-180.0,
            high=180.0,
            meaning="turn of the marker, counter-clockwise; at 0 its top is north",
            source="any direction",
        ),
        Parameter(
            name="worn_percent",
            nominal=0.0,
            low=0.0,
            high=20.0,
            meaning="share of border and bits that is worn off in patches: the ground shows",
            source="ASTM D913: wear bares the substrate, graded by the share that is left; 20 % is "
            "an engineering estimate of when a pad is painted again",
        ),
        CLEARANCE,
    ),
)
