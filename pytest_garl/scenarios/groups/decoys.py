"""Decoys: up to three things on the ground that could be taken for the marker."""

from __future__ import annotations

from pytest_garl.scenarios.groups.parameter import Group, Parameter

KINDS = (
    "none",
    "other-id",
    "same-id-without-margin",
    "helipad-h",
    "chequered-mat",
    "window",
    "grate",
    "qr-code",
)
"""What the numbers of ``kind`` mean."""
REACH_M = 7.5


def _place(axis: str, direction: str) -> Parameter:
    return Parameter(
        name=f"{axis}_m",
        even=True,
        nominal=0.0,
        low=-REACH_M,
        high=REACH_M,
        meaning=f"how far {direction} of the map's coordinate its middle lies; moved off the "
        "marker and other decoys",
        source="the disc in which the marker may lie",
    )


def _group(number: int) -> Group:
    return Group(
        name=f"decoy-{number}",
        meaning="a thing on the ground that could be taken for the marker",
        parameters=(
            Parameter(
                name="kind",
                even=True,
                choices=KINDS,
                nominal=0.0,
                low=0.0,
                high=float(len(KINDS) - 1),
                meaning=", ".join(f"{index}: {kind}" for index, kind in enumerate(KINDS)),
                source="other ids of the family: personalrobotics/apriltags issue 18; a missing "
                "margin: opencv_contrib issue 1698; H: ICAO Annex 14; boards of squares: opencv "
                "issue 24117; windows: zoloto issue 207; things on the ground: apriltag issue 361; "
                "high-contrast patterns, of which a grate and a QR code are two: "
                "personalrobotics/apriltags issue 18",
            ),
            _place("x", "east"),
            _place("y", "north"),
            Parameter(
                name="yaw_deg",
                even=True,
                nominal=0.0,
                low=-180.0,
                high=180.0,
                meaning="its turn, counter-clockwise",
                source="any direction",
            ),
        ),
    )


GROUPS = tuple(_group(number) for number in (1, 2, 3))
