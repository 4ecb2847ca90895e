"""A tarpaulin hides a part of the marker for its seconds, and nothing before and after."""

from __future__ import annotations

import numpy as np
import pytest

from pytest_garl import Camera
from pytest_garl.flight.flight import MarkerView
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.camera.cover_event import renderer_of
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.landing_moments import LandingMoments
from pytest_garl.simulation.randomness import generator
from tests.support.flights import EMPTY, nominal

LEVEL = (0.0, 0.0, 0.0, 1.0)


def frame(share: float, time_s: float = 12.0, *, colour: bool = True, yaw: float = 0.0) -> Frame:
    event = {"cover__from_s": 10.0, "cover__lasts_s": 5.0, "cover__share_percent": share}
    placed = Placed(nominal(**event, pad__yaw_deg=yaw), EMPTY)
    renderer = renderer_of(placed, Camera(), LandingMoments(), colour=colour)
    x, y = renderer.marker_m
    return renderer.render((x, y, 4.0), LEVEL, time_s, [])


def view(share: float) -> MarkerView:
    seen = frame(share).marker
    assert seen is not None
    return seen


@pytest.mark.parametrize("time_s", [9.99, 15.0])
def test_nothing_lies_there_before_and_after(time_s: float) -> None:
    scenario = nominal()
    plain = Renderer(Placed(scenario, EMPTY), Camera(), generator(scenario.seed, "sensor"))
    x, y = plain.marker_m
    expected = plain.render((x, y, 4.0), LEVEL, time_s, [])
    found = frame(50.0, time_s)
    assert np.array_equal(found.image, expected.image)
    assert np.array_equal(found.segmentation, expected.segmentation)
    assert found.marker == expected.marker


@pytest.mark.parametrize("share", [10.0, 40.0, 80.0])
@pytest.mark.parametrize("yaw", [0.0, 30.0])
def test_the_cover_hides_its_share_of_the_markers_pixels(share: float, yaw: float) -> None:
    free = frame(0.0, yaw=yaw).segmentation == 1
    left = frame(share, yaw=yaw).segmentation == 1
    assert left.sum() / free.sum() == pytest.approx(1 - share / 100, abs=0.05)


def test_the_picture_shows_the_cover_where_the_marker_is_hidden() -> None:
    bare, covered = frame(0.0), frame(40.0)
    hidden = (bare.segmentation == 1) & (covered.segmentation != 1)
    seen = covered.segmentation == 1
    change = np.abs(bare.image.astype(int) - covered.image.astype(int)).max(axis=2)
    assert np.median(change[hidden]) > 40
    assert np.median(change[seen]) < 3


def test_the_oracle_sees_less_of_the_marker_the_more_is_covered() -> None:
    views = [view(share) for share in (0.0, 10.0, 40.0, 100.0)]
    for name in ("border_hidden", "bits_hidden"):
        hidden = [getattr(each, name) for each in views]
        assert hidden == sorted(hidden)
        assert hidden[0] < 0.02 < hidden[2]
    assert views[3].bits_hidden > 0.2


def test_a_renderer_without_colour_tells_the_same_of_a_covered_marker() -> None:
    assert frame(40.0, colour=False).marker == frame(40.0).marker
