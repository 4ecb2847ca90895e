"""A user's marker: OpenCV's dictionaries, and what is refused."""

from __future__ import annotations

from typing import Any

import cv2
import pytest

from pytest_garl.errors import ScenarioError
from pytest_garl.fiducial import DICTIONARIES, MarkerSpec, NestedMarker


def test_the_table_has_all_dictionaries_of_opencv() -> None:
    # OpenCV gives some dictionaries a second name, in capitals.
    names = {name for name in dir(cv2.aruco) if name.startswith("DICT_")}
    assert {name.upper() for name in names} == {name.upper() for name in DICTIONARIES}
    for name, known in DICTIONARIES.items():
        found = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
        assert (found.markerSize, len(found.bytesList)) == (known.bits, known.size), name


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"dictionary": "DICT_8X8"}, "found dictionary = 'DICT_8X8', expected one of DICT_4X4_50"),
        ({"id": 50}, "found id = 50, expected a whole number from 0 to 49 .DICT_5X5_50 has 50"),
        ({"id": True}, "found id = True"),
        ({"side_m": 0.01}, "found side_m = 0.01, expected 0.05 to 5 metres"),
        ({"side_m": float("nan")}, "found side_m = nan"),
        ({"nested": (NestedMarker(id=0, side_m=0.2),)}, "found the ids 0, 0 on one board"),
        (
            {"nested": (NestedMarker(id=1, side_m=0.2, offset_m=(9.0, 0.0)),)},
            r"marker.nested\[0\]: found offset_m = \(9.0, 0.0\), expected .* within 5 m",
        ),
        ({"nested": [NestedMarker(id=1, side_m=0.2)]}, "expected a tuple of at most 16"),
    ],
)
def test_a_marker_that_does_not_exist_is_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        MarkerSpec(**given)
