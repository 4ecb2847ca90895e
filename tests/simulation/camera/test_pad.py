"""A marker lies turned and worn as the scenario says, in pictures and for the oracle alike."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_garl import Camera
from pytest_garl.flight.flight import MarkerView
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import problems
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.camera.marker_patch import GREY, modules
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.randomness import generator
from tests.support.flights import EMPTY, nominal

CAMERA, HEIGHT_M = Camera(), 3.5
LEVEL = (0.0, 0.0, 0.0, 1.0)


def look(scenario: Scenario) -> tuple[Frame, MarkerView]:
    renderer = Renderer(Placed(scenario, EMPTY), CAMERA, generator(scenario.seed, "sensor"))
    x, y = renderer.marker_m
    frame = renderer.render((x, y, HEIGHT_M), LEVEL, 0.0, [])
    assert frame.marker is not None
    return frame, frame.marker


def top_left(frame: Frame) -> NDArray[np.float64]:
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
    grey = cv2.cvtColor(frame.image, cv2.COLOR_RGB2GRAY)
    corners, _, _ = cv2.aruco.ArucoDetector(family).detectMarkers(grey)
    first: NDArray[np.float64] = np.asarray(corners[0], np.float64).reshape(4, 2)[0]
    offset: NDArray[np.float64] = first - np.array(CAMERA.centre_px)
    return offset


@pytest.mark.parametrize("yaw", [-120.0, 30.0, 90.0])
def test_the_marker_turns_in_the_picture_by_its_yaw(yaw: float) -> None:
    straight, turned = top_left(look(nominal())[0]), top_left(look(nominal(pad__yaw_deg=yaw))[0])
    before, after = (np.degrees(np.arctan2(-each[1], each[0])) for each in (straight, turned))
    assert (after - before - yaw + 180) % 360 - 180 == pytest.approx(0.0, abs=1.5)


def test_the_oracle_sees_a_turned_marker_as_a_straight_one() -> None:
    straight, turned = look(nominal())[1], look(nominal(pad__yaw_deg=30.0))[1]
    assert turned.px_per_module == pytest.approx(straight.px_per_module, rel=1e-3)
    assert turned.contrast == pytest.approx(straight.contrast, rel=0.02)
    assert turned.bits_hidden + turned.border_hidden < 0.02


def worn_in_picture(frame: Frame, clean: Frame) -> float:
    """Return the share of the marker's pixels whose grey wear has changed."""
    mask = clean.segmentation == 1
    before, after = (each.image.astype(np.float32) @ GREY for each in (clean, frame))
    return float((np.abs(before - after)[mask] > 30).mean())


@pytest.mark.parametrize("percent", [5.0, 10.0, 20.0])
@pytest.mark.parametrize("yaw", [0.0, 50.0])
def test_the_marker_is_worn_as_much_as_the_scenario_says(percent: float, yaw: float) -> None:
    clean = look(nominal(pad__yaw_deg=yaw))[0]
    worn = look(nominal(pad__yaw_deg=yaw, pad__worn_percent=percent))[0]
    assert worn_in_picture(worn, clean) == pytest.approx(percent / 100, abs=0.03)


def test_the_oracle_sees_wear_that_grows() -> None:
    views = [look(nominal(pad__worn_percent=percent))[1] for percent in (0.0, 10.0, 20.0)]
    hidden = [each.border_hidden + each.bits_hidden for each in views]
    assert hidden == sorted(hidden)
    # Ground is between black and white, so that a worn place is partly wrong.
    assert 0.05 < hidden[2] < 0.45


def test_the_oracle_agrees_with_the_picture_about_worn_modules() -> None:
    frame, view = look(nominal(pad__worn_percent=20.0))
    clean, _ = look(nominal())
    white = modules(0, "DICT_5X5_50")[1:-1, 1:-1]
    grey, reference = (each.image.astype(np.float64) @ GREY for each in (frame, clean))
    mask = clean.segmentation == 1
    rows, columns = np.nonzero(mask)
    low, high = np.percentile(reference[mask], [5, 95])
    colour = reference[mask] > (low + high) / 2

    def wrong(picture: NDArray[np.float64]) -> NDArray[np.float64]:
        level = np.clip((picture[mask] - low) / (high - low), 0, 1)
        error: NDArray[np.float64] = np.where(colour, 1 - level, level)
        return error

    # Without the edges of modules, which are grey in a clean picture too.
    more = wrong(grey) - wrong(reference)
    size = columns.max() - columns.min() + 1
    module = np.minimum(
        (columns - columns.min()) * len(white) // size, (rows - rows.min()) * len(white) // size
    )
    farthest = np.maximum(
        (columns - columns.min()) * len(white) // size, (rows - rows.min()) * len(white) // size
    )
    border = (module == 0) | (farthest == len(white) - 1)
    assert view.border_hidden == pytest.approx(float(more[border].mean()), abs=0.06)
    assert view.bits_hidden == pytest.approx(float(more[~border].mean()), abs=0.06)


def test_markers_wear_differently_with_another_seed_and_alike_with_the_same() -> None:
    scenario = nominal(pad__worn_percent=15.0)
    other = dataclasses.replace(scenario, seed=scenario.seed + 1)
    assert look(scenario)[1] == look(scenario)[1]
    assert look(scenario)[1].bits_hidden != look(other)[1].bits_hidden


def test_a_smaller_clearance_allows_places_nearer_to_obstacles() -> None:
    # The ring about the coordinate, every few degrees: how many places are valid.
    angles = np.linspace(0, 2 * np.pi, 90)
    places = [(r * np.cos(a), r * np.sin(a)) for a in angles for r in (0.6, 0.7, 0.8, 0.9, 1.0)]

    def valid(clearance_m: float) -> set[tuple[float, float]]:
        base = nominal().replace({"pad.clearance_m": clearance_m})
        return {
            (x, y)
            for x, y in places
            if not problems(base.replace({"marker.x": x, "marker.y": y}), EMPTY)
        }

    usual, near = valid(1.3), valid(0.6)
    assert usual < near
