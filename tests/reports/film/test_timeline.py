"""The lower part of the picture."""

from __future__ import annotations

from pytest_garl.reports.film import frames
from pytest_garl.scenarios.placed import Placed
from tests.support.videos import CAMERA_PART, LAWN, SCENARIO, STRIP, Hovers, Video


def test_the_strip_shows_the_signature(video: Video) -> None:
    camera = Hovers.airframe.camera
    other = next(frames(video.flight, Placed(SCENARIO, LAWN), camera, "IV:dog:last-metre:seen"))
    assert (video.pictures[0][STRIP] != other[STRIP]).any()
    assert (video.pictures[0][CAMERA_PART] == other[CAMERA_PART]).all()
