"""A camera that is mounted with a yaw, a tilt and an offset, as the airframe declares it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pytest_garl import Airframe, Camera, Observation, PositionSetpoint
from pytest_garl.airframe import airframe_of
from pytest_garl.errors import LandingSystemError
from pytest_garl.flight.flight import Track
from pytest_garl.npcs.encounter import in_picture
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.camera.lens import Lens
from pytest_garl.simulation.camera.meshes import rotation_matrix
from pytest_garl.simulation.camera.projection import View, eye_under
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.camera.true_camera import looks_at, mount_of
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.randomness import generator
from tests.support.flights import EMPTY, STAND, Scripted, nominal

LEVEL = (0.0, 0.0, 0.0, 1.0)
BANKED = (0.1, -0.2, 0.3, math.sqrt(0.86))
AHEAD, LEFT, DOWN = (8.0, 0.0, 0.0), (0.0, 8.0, 0.0), (0.0, 0.0, 0.0)


def pixel(camera: Camera, place: tuple[float, float, float], attitude: Any = LEVEL) -> Any:
    """Return where a UAV 8 m above the origin shows a place, from the picture's middle."""
    eye = eye_under((0.0, 0.0, 8.0), attitude, camera.offset_m)
    view = View.of(camera, eye, attitude)
    x, y, depth = view.axes @ (np.array(place) - view.eye)
    assert depth > 0
    return np.array([x, y]) / depth


@pytest.mark.parametrize(
    ("mount", "place", "shown"),
    [
        ({}, AHEAD, (0.0, -1.0)),
        ({}, LEFT, (-1.0, 0.0)),
        ({"yaw_rad": math.pi / 2}, LEFT, (0.0, -1.0)),
        ({"yaw_rad": math.pi / 2}, AHEAD, (1.0, 0.0)),
        ({"yaw_rad": math.pi}, AHEAD, (0.0, 1.0)),
        ({"tilt_rad": math.pi / 4}, AHEAD, (0.0, 0.0)),
        ({"tilt_rad": math.pi / 4}, DOWN, (0.0, 1.0)),
        ({"tilt_rad": math.pi / 2}, AHEAD, (0.0, 1.0)),
        ({"tilt_rad": -math.pi / 4}, DOWN, (0.0, -1.0)),
        ({"yaw_rad": math.pi / 2, "tilt_rad": math.pi / 4}, LEFT, (0.0, 0.0)),
    ],
)
def test_a_place_is_where_the_mount_shows_it(
    mount: dict[str, float], place: Any, shown: tuple[float, float]
) -> None:
    camera = Camera(**mount, offset_m=(0.0, 0.0, 0.0))  # type: ignore[arg-type]
    assert pixel(camera, place) == pytest.approx(shown, abs=1e-12)


def test_an_offset_moves_the_camera_with_the_body() -> None:
    nose = Camera(offset_m=(0.4, -0.1, 0.05))
    east, north = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))
    assert eye_under((1, 2, 3), east, nose.offset_m) == pytest.approx((1.4, 1.9, 3.05))
    assert eye_under((1, 2, 3), north, nose.offset_m) == pytest.approx((1.1, 2.4, 3.05))


def test_a_camera_that_is_not_turned_is_drawn_to_the_byte_as_before() -> None:
    body = rotation_matrix(BANKED)
    axes = -np.stack([body[:, 1], body[:, 0], body[:, 2]])
    assert (View.of(Camera(), (0.0, 0.0, 1.0), BANKED).axes == axes).all()


def test_a_lens_that_distorts_keeps_the_mount() -> None:
    camera = Camera(distortion=(0.05, 0.0, 0.0, 0.0), yaw_rad=0.5, tilt_rad=0.25)
    assert mount_of(Lens(camera).pinhole) == mount_of(camera)


@pytest.mark.parametrize("tilt_deg", [-60, -30, 0, 20, 45, 60, 75])
@pytest.mark.parametrize("yaw_deg", [0, 90, -135])
def test_a_nominal_landing_shows_the_marker_to_the_camera_whatever_its_mount(
    tilt_deg: float, yaw_deg: float
) -> None:
    """Else a landing that was given up in clear air would be excused."""
    camera = Camera(
        yaw_rad=math.radians(yaw_deg), tilt_rad=math.radians(tilt_deg), offset_m=(0.3, 0.0, 0.1)
    )
    scenario = nominal()
    renderer = Renderer(Placed(scenario, EMPTY), camera, generator(5, "sensor"), colour=False)
    place = looks_at(camera, renderer.marker_m[:2], 6.0)
    frame = renderer.render(eye_under(place, LEVEL, camera.offset_m), LEVEL, 0.0, [])
    assert frame.marker is not None
    assert frame.marker.share_in_frame == 1.0


def test_a_nominal_landing_of_a_camera_that_looks_down_is_above_the_marker() -> None:
    assert looks_at(Camera(yaw_rad=1.0), (3.25, -1.5), 6.0) == (3.25, -1.5, 6.0)


def test_the_director_knows_what_a_turned_camera_shows() -> None:
    camera = Camera(yaw_rad=0.7, tilt_rad=0.6, offset_m=(0.2, 0.1, 0.0))
    rng = np.random.default_rng(3)
    attitudes = rng.normal((0, 0, 0, 1), 0.15, (200, 4))
    attitudes /= np.linalg.norm(attitudes, axis=1, keepdims=True)
    places = rng.uniform((-4, -4, 2), (4, 4, 9), (200, 3))
    track = Track(
        time_s=np.arange(200.0),
        position_m=places,
        attitude=attitudes,
        velocity_mps=np.zeros((200, 3)),
    )
    dog = OBJECT_TYPES["dog"]
    shown = in_picture(track, np.zeros((200, 3)), dog, camera)
    parts_m = [dog.low_m + share * dog.height_m for share in (0.0, 0.5, 1.0)]
    for index in range(200):
        q = tuple(attitudes[index].tolist())
        view = View.of(camera, eye_under(tuple(places[index].tolist()), q, camera.offset_m), q)
        x, y, depth = view.axes @ (np.array([[0, 0, z] for z in parts_m]) - view.eye).T
        reach_x, reach_y = view.reach
        inside = (depth > 0) & (abs(x) < reach_x * depth) & (abs(y) < reach_y * depth)
        assert shown[index] == inside.any()
    assert 20 < shown.sum() < 180


class LooksAhead(Scripted):
    """Stands in the air 10 m before the marker, as high, and looks at it."""

    airframe = Airframe(latency_s=0.0, camera=Camera(tilt_rad=math.pi / 4))
    needs_camera = True
    seen: Any = None

    def step(self, observation: Observation) -> PositionSetpoint:
        type(self).seen = observation
        if observation.time_s < 4.0:
            return self.hover(10.0)
        return PositionSetpoint(position_m=(-10.0, 0.0, 10.0))


def test_a_flight_records_what_the_mounted_camera_shows() -> None:
    scenario = nominal(marker__x=0.0, marker__y=0.0)
    flight = fly(scenario, LooksAhead, STAND, map=EMPTY, time_limit_s=14.0)
    last = flight.steps[-1]
    assert last.marker_visible == 1.0
    # The marker is in the middle: as deep as it is far along the camera's axis.
    middle = LooksAhead.seen.depth_m[110:130, 150:170]
    assert middle.mean() == pytest.approx(10.0 * math.sqrt(2), abs=0.5)


def test_the_declared_mount_is_read_with_the_airframe() -> None:
    camera = Camera(yaw_rad=1, tilt_rad=-1, offset_m=[0, 0.5, 0])  # type: ignore[arg-type]
    read = airframe_of(type("System", (), {"airframe": Airframe(camera=camera)})).camera
    assert (read.yaw_rad, read.tilt_rad, read.offset_m) == (1.0, -1.0, (0.0, 0.5, 0.0))
    assert read == camera


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (
            {"yaw_rad": 90.0},
            "Camera.yaw_rad = 90.0; expected a number from -3.14159 to 3.14159 rad",
        ),
        ({"tilt_rad": math.nan}, "Camera.tilt_rad = nan"),
        ({"offset_m": (0.0, 0.0, -0.3)}, "z not below -0.15 m"),
        ({"offset_m": (0.0, 20.0, 0.0)}, "none beyond 2.5 m"),
        ({"offset_m": (0.0, 0.1)}, "expected \\(x, y, z\\)"),
        ({"offset_m": "front"}, "expected \\(x, y, z\\)"),
        ({"offset_m": (math.nan, 0.0, 0.0)}, "Camera.offset_m"),
    ],
)
def test_a_mount_that_no_camera_has_is_refused(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(LandingSystemError, match=words.replace(".", r"\.")):
        Camera(**wrong)
