"""All groups of conditions, in the order in which files list them."""

from __future__ import annotations

from pytest_garl.scenarios.groups import (
    camera,
    decoys,
    depth,
    events,
    light,
    navigation,
    pad,
    timing,
    told,
    wind,
)
from pytest_garl.scenarios.groups.parameter import Group, Parameter

GROUPS: dict[str, Group] = {
    each.name: each
    for each in (
        light.GROUP,
        wind.GROUP,
        *navigation.GROUPS,
        told.GROUP,
        timing.GROUP,
        camera.GROUP,
        depth.GROUP,
        pad.GROUP,
        *decoys.GROUPS,
        *events.GROUPS,
    )
}
PARAMETERS: dict[str, Parameter] = {
    key: each
    for group in GROUPS.values()
    for key, each in zip(group.keys, group.parameters, strict=True)
}
WEATHER_CAUSES = {
    "dust": ("dust",),
    "fog": ("fog",),
    "rain": ("rain", "road_wetness"),
    "snow": ("snow", "road_snow"),
    "leaves": ("maple_leaf", "road_leaf"),
}
"""Weather genes that one cause switches on together: rain wets the ground, snow covers it."""
