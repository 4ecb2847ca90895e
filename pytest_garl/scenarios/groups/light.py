"""Light: where the sun stands off its way over the day.

The position on that way is a gene of the paper (`genes.py`); files write both together as the sun's
elevation and azimuth (`units.py`).
"""

from __future__ import annotations

from pytest_garl.scenarios.groups.parameter import Group, Parameter

GROUP = Group(
    name="light",
    meaning="the sun's elevation and azimuth",
    parameters=(
        Parameter(
            name="turn_deg",
            even=True,
            nominal=0.0,
            low=-180.0,
            high=180.0,
            meaning="turn of the sun about the vertical, off its way from east to west",
            source="any direction: pads and cameras face every way",
        ),
    ),
)
