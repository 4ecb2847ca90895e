"""The coordinate that the mission gives, which is not where the marker lies."""

from __future__ import annotations

from pytest_garl.scenarios.groups.parameter import Group, Parameter


def _axis(name: str, axis: str) -> Parameter:
    return Parameter(
        name=name,
        nominal=0.0,
        low=-20.0,
        high=20.0,
        meaning=f"error of the told coordinate, {axis}",
        source="u-blox M8 data sheet: 2.5 m CEP; twice that for a pad surveyed with a phone",
    )


GROUP = Group(
    name="told",
    meaning="error of the coordinate that the mission gives",
    parameters=(_axis("x_m", "east"), _axis("y_m", "north")),
)
