from __future__ import annotations

import dataclasses
import math
import subprocess
import sys
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pytest
from numpy.typing import NDArray

from lab.train_detector.scenes import (
    CAMERA,
    Print,
    pictures,
    random_pose,
    truth,
)
from lab.train_detector.scoring import mission, observation_of, score
from landing_systems.modules.detection_tphyolo.detector import (
    LARGEST_SIDE_PX,
    TphYoloDetector,
    fitted,
    ground_place,
)
from landing_systems.modules.detection_tphyolo.patches import PATCH_PX, REACH, normalised, patch
from pytest_garl import Observation
from pytest_garl.fiducial import MarkerSpec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.task import Task
from pytest_garl.simulation.camera.projection import View
from pytest_garl.simulation.camera.renderer import Renderer

NONE: Mapping[str, float] = MappingProxyType({})
LEVEL = (0.0, 0.0, 0.0, 1.0)
BLACK = np.zeros((240, 320, 3), np.uint8)


def renderer(number: int = 0, genes: Mapping[str, float] = NONE) -> Renderer:
    map = dataclasses.replace(load_map("lawn"), objects=(("person", 1),))
    genome = genome_for(map, weather="full")
    scenario = decode(genome.nominal, genome, map="lawn", seed=1)
    scenario = scenario.replace({f"environment.{name}": value for name, value in genes.items()})
    scenario = dataclasses.replace(scenario, task=Task(marker=MarkerSpec(id=number)))
    return Renderer(Placed(scenario, map), CAMERA, np.random.default_rng(0))


def observed(
    position: tuple[float, float, float],
    attitude: tuple[float, float, float, float] = LEVEL,
    image: NDArray[np.uint8] = BLACK,
) -> Observation:
    return Observation(
        time_s=0.0,
        position_m=np.array(position),
        velocity_mps=np.zeros(3),
        attitude=np.array(attitude),
        image=image,
        depth_m=np.zeros(image.shape[:2], np.float32),
    )


def test_a_box_is_placed_where_its_ray_meets_the_ground() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        position, attitude = random_pose(rng, (2.0, -1.0))
        view = View.of(CAMERA, position, attitude)
        seen = (np.array([[2.0, -1.0, 0.0]]) - view.eye) @ view.axes.T
        centre = view.pixels(seen)[0] + 0.5
        found = ground_place(centre, CAMERA, observed(position, attitude))
        assert found is not None
        assert found[0] == pytest.approx((2.0, -1.0), abs=1e-3)
        assert found[1] == pytest.approx(position[2] / seen[0, 2], rel=1e-3)


def test_a_ray_to_the_sky_has_no_place_on_the_ground() -> None:
    on_its_back = observed((0.0, 0.0, 5.0), (1.0, 0.0, 0.0, 0.0))
    assert ground_place(np.array([160, 120], np.float32), CAMERA, on_its_back) is None


def test_a_frame_from_low_down_is_shrunk_into_the_middle() -> None:
    image = np.full((240, 320, 3), 200, np.uint8)
    assert fitted(image, 40.0)[0] is image
    picture, scale, (left, top) = fitted(image, 2 * LARGEST_SIDE_PX)
    assert (scale, left, top) == (0.5, 80, 60)
    assert (picture[60:180, 80:240] == 200).all()
    assert (picture != 200).all(axis=2).sum() == 320 * 240 * 3 / 4


def test_a_patch_holds_the_marker_at_one_scale_however_large_it_is() -> None:
    cell = PATCH_PX / REACH / 7
    for side in (20, 56):
        image = np.full((200, 200, 3), 255, np.uint8)
        image[100 - side // 2 : 100 + side // 2, 80 - side // 2 : 80 + side // 2] = 0
        cut = patch(image, (80, 100), side, math.pi / 2)
        dark = np.flatnonzero(cut[PATCH_PX // 2, :, 0] < 128)
        assert abs(len(dark) - 7 * cell) <= 1.5
        assert abs(dark.mean() - (PATCH_PX - 1) / 2) <= 0.5


def test_fog_and_night_do_not_change_a_normalised_patch() -> None:
    rng = np.random.default_rng(0)
    clear = rng.integers(0, 255, (1, PATCH_PX, PATCH_PX, 3)).astype(np.uint8)
    foggy = (0.2 * clear + 150).astype(np.uint8)
    assert normalised(clear) == pytest.approx(normalised(foggy), abs=0.03)


def test_the_truth_of_a_clear_marker() -> None:
    made = renderer()
    x, y = made.marker_m
    position = (x + 1.0, y, 6.0)
    frame = made.render(position, LEVEL, 0.0, [((50.0, 50.0, 0.0), 0.0)])
    marker = truth(Print(marker_id=0, place_m=(x, y)), made, frame, position, LEVEL)
    assert marker is not None
    # At zero yaw the image's top is east, so what lies 1 m west is 160 / 6 px further down.
    assert marker.centre_px == pytest.approx((160, 120 + 160 / 6), abs=0.1)
    assert marker.size_px == pytest.approx((40, 40), abs=0.1)
    assert marker.side_px == pytest.approx(40)
    assert (marker.framed, marker.hidden) == (1.0, 0.0)
    assert marker.contrast > 100


@pytest.mark.parametrize(
    ("genes", "person", "low", "high"),
    [
        ({}, True, 0.05, 0.6),
        ({"road_leaf": 0.5}, False, 0.3, 0.7),
        ({"road_snow": 1.0}, False, 0.99, 1.0),
    ],
)
def test_people_leaves_and_snow_hide_a_marker(
    genes: dict[str, float], person: bool, low: float, high: float
) -> None:
    made = renderer(genes=genes)
    x, y = made.marker_m
    position = (x, y, 6.0)
    at = (x, y, 0.0) if person else (50.0, 50.0, 0.0)
    frame = made.render(position, LEVEL, 0.0, [(at, 0.0)])
    marker = truth(Print(marker_id=0, place_m=(x, y)), made, frame, position, LEVEL)
    assert marker is not None
    assert low <= marker.hidden <= high


def test_fog_takes_the_contrast() -> None:
    made = renderer(genes={"fog": 1.0})
    x, y = made.marker_m
    frame = made.render((x, y, 12.0), LEVEL, 0.0, [((50.0, 50.0, 0.0), 0.0)])
    marker = truth(Print(marker_id=0, place_m=(x, y)), made, frame, (x, y, 12.0), LEVEL)
    assert marker is not None
    assert marker.contrast < 5


def test_the_shipped_weights_find_the_marker_and_tell_it_from_another() -> None:
    detector = TphYoloDetector(mission())
    for number, expected in ((0, [0]), (3, [3]), (17, [])):
        made = renderer(number)
        x, y = made.marker_m
        for height in (2.5, 5.0, 9.0):
            position = (x + 0.3, y - 0.4, height)
            frame = made.render(position, LEVEL, 0.0, [((50.0, 50.0, 0.0), 0.0)])
            found = detector.detect(observed(position, image=frame.image))
            sure = [item for item in found if item.confidence >= 0.8]
            assert [item.marker_id for item in sure] == expected
            for item in sure:
                assert item.position_m[:2] == pytest.approx((x, y), abs=0.25)


def test_a_marker_that_the_frame_cuts_is_nothing_to_land_on() -> None:
    made = renderer()
    detector = TphYoloDetector(mission())
    x, y = made.marker_m
    # At zero yaw the image's top is east: half a side out of the frame, then wholly inside.
    for height in (3.0, 1.8):
        for away, found in ((0.75 * height, height > 2.0), (0.0, True)):
            position = (x - away, y, height)
            frame = made.render(position, LEVEL, 0.0, [((50.0, 50.0, 0.0), 0.0)])
            seen = detector.detect(observed(position, image=frame.image))
            assert [each.marker_id for each in seen] == ([0] if found else []), (height, away)


def test_detections_are_judged_by_the_marker_on_which_they_lie() -> None:
    rng = np.random.default_rng(8)
    picture = next(
        each
        for each in pictures(rng, load_map("lawn"), "confined", 20)
        if each.markers and each.markers[0].framed == 1.0
    )
    detector = TphYoloDetector(mission(), min_confidence=0.001)
    u, v = picture.markers[0].centre_px
    shown = detector.detect(observation_of(picture))
    template = shown[0]
    here = tuple((u + dx, v + dy) for dx, dy in ((-5, -5), (5, -5), (5, 5), (-5, 5)))
    far = tuple((u + 400, v) for _ in range(4))
    judged = score(
        picture,
        [
            dataclasses.replace(template, marker_id=0, corners_px=here),
            dataclasses.replace(template, marker_id=2, corners_px=here),
            dataclasses.replace(template, marker_id=0, corners_px=far),
        ],
    )
    assert [each.kind for each in judged] == ["right", "wrong-id", "nothing-there"]


def test_flying_needs_neither_torch_nor_the_simulator() -> None:
    code = (
        "import sys, landing_systems.modules.detection_tphyolo.detector;"
        "print([n for n in sys.modules if n in ('torch', 'pytest_garl.simulation')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(("dictionary", "number"), [("DICT_APRILTAG_36h11", 0), ("DICT_5X5_50", 7)])
def test_a_marker_that_the_network_does_not_know_is_refused(dictionary: str, number: int) -> None:
    unknown = dataclasses.replace(mission(), marker_dictionary=dictionary, marker_id=number)
    with pytest.raises(ValueError, match=f"found marker {number} of {dictionary}, expected one of"):
        TphYoloDetector(unknown)


def test_a_larger_dictionary_of_the_same_bits_is_accepted() -> None:
    TphYoloDetector(dataclasses.replace(mission(), marker_dictionary="DICT_5X5_1000", marker_id=3))
