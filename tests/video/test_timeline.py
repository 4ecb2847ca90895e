"""The lower part of the picture."""

from __future__ import annotations

from pytest_garl.video import frames
from tests.support.films import CAMERA_PART, LAWN, SCENARIO, STRIP, Film, Hovers


def test_the_strip_shows_the_signature(film: Film) -> None:
    camera = Hovers.airframe.camera
    other = next(frames(film.flight, SCENARIO, LAWN, camera, "IV:dog:last-metre:seen"))
    assert (film.pictures[0][STRIP] != other[STRIP]).any()
    assert (film.pictures[0][CAMERA_PART] == other[CAMERA_PART]).all()
