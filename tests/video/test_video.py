from __future__ import annotations

import dataclasses
import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import cv2
import imageio_ffmpeg
import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_garl import Command, Mission, Observation, PositionSetpoint
from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.errors import GarlError
from pytest_garl.landing_system import Airframe, Camera, Detection, Diagnostics
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.placement import marker_genes
from pytest_garl.search.methods.random import propose
from pytest_garl.simulation.flight import Contact, Flight, Track
from pytest_garl.simulation.fly import fly
from pytest_garl.video import frames, rate_hz, save_video, write
from pytest_garl.video.drawing import HIT, MARKER, OBJECTS, SYSTEM, UAV, Image
from pytest_garl.video.pose import path_until, poses_at
from tests.simulation.test_environment import WEATHERMAKER

LAWN = load_map("lawn")
SCENARIO = propose(LAWN, genome_for(LAWN), 3, 0, 1)[0].without("bird-1")
FLOWN_S, CLOSING_FRAMES = 3.0, 20
SPEAKS_FROM_S = 1.5
CORNERS = ((100.0, 60.0), (180.0, 60.0), (180.0, 140.0), (100.0, 140.0))
TARGET = (4.0, 12.0, 0.0)
PLAN = ((0.0, -16.5, 3.0), (-5.0, -12.0, 3.0))
CAMERA_PART, STRIP, MAP_PART = np.s_[:480, :640], np.s_[480:, :640], np.s_[:, 640:]


class Hovers:
    """Climbs to 3 m, keeps what it sees, and after a while believes something."""

    airframe = Airframe(latency_s=0.0, camera=Camera(width_px=640, height_px=480))
    seen: ClassVar[list[Image]] = []

    def reset(self, mission: Mission) -> None:
        self.home = mission.home_m
        self.seen.clear()

    def step(self, observation: Observation) -> Command:
        self.seen.append(observation.image.copy())
        thoughts = None
        if observation.time_s >= SPEAKS_FROM_S:
            found = Detection(marker_id=0, confidence=0.9, position_m=TARGET, corners_px=CORNERS)
            thoughts = Diagnostics(
                phase="hover", detections=(found,), target_m=TARGET, planned_path_m=PLAN
            )
        return PositionSetpoint(position_m=(*self.home[:2], 3.0), diagnostics=thoughts)


class NeverBegins(Hovers):
    def reset(self, mission: Mission) -> None:
        raise ZeroDivisionError("no plan")


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Film:
    flight: Flight
    seen: list[Image]
    pictures: list[Image]


@pytest.fixture(scope="module")
def film() -> Film:
    flight = fly(SCENARIO, Hovers, policy_spec("waypoint"), time_limit_s=FLOWN_S)
    pictures = frames(flight, SCENARIO, LAWN, Hovers.airframe.camera, "II:lost:descent")
    return Film(flight=flight, seen=list(Hovers.seen), pictures=list(pictures))


def painted(picture: Image, colour: tuple[int, int, int]) -> NDArray[np.int64]:
    """Return the (column, row) pairs of the pixels of exactly this colour."""
    return np.argwhere((picture == colour).all(axis=-1))[:, ::-1]


def on_the_map(x: float, y: float) -> tuple[float, float]:
    """Where a place lies in the map's part: bounds and 2 m beyond fill its height."""
    scale = 656 / (40 + 2 * 2)
    return 384 / 2 + x * scale, 656 / 2 - y * scale


def test_there_is_a_picture_for_each_camera_frame_and_two_seconds_of_the_end(film: Film) -> None:
    assert len(film.flight.steps) == 30
    assert len(film.pictures) == 30 + CLOSING_FRAMES
    assert {(each.shape, each.dtype.name) for each in film.pictures} == {((656, 1024, 3), "uint8")}
    assert all((each == film.pictures[-1]).all() for each in film.pictures[-CLOSING_FRAMES:])


def test_the_camera_pane_shows_the_systems_image(film: Film) -> None:
    # Every fifth frame falls on a recorded pose; between two the pose is interpolated.
    for index, most in ((5, 0.01), (10, 0.01), (12, 3.0), (14, 3.0)):
        shown = film.pictures[index][CAMERA_PART].astype(int)
        assert np.abs(shown - film.seen[index]).mean() <= most
    assert np.abs(film.seen[5].astype(int) - film.seen[10]).mean() > 3.0


def test_the_camera_part_shows_the_environment_as_it_was_changed() -> None:
    flight = fly(SCENARIO, Hovers, WEATHERMAKER, time_limit_s=FLOWN_S)
    assert any(item.changes for item in flight.objects)
    pictures = list(frames(flight, SCENARIO, LAWN, Hovers.airframe.camera))
    # From 1.5 s on what it believes is drawn over what it sees.
    for index, most in ((5, 0.01), (10, 0.01), (15, 2.0), (20, 2.0), (25, 2.0)):
        shown = pictures[index][CAMERA_PART].astype(int)
        assert np.abs(shown - Hovers.seen[index]).mean() <= most
    assert np.abs(Hovers.seen[5].astype(int) - Hovers.seen[10]).mean() > 20.0


def test_the_marker_is_drawn_at_its_place_on_the_map(film: Film) -> None:
    places = painted(film.pictures[0][MAP_PART], MARKER)
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    assert math.dist(middle, on_the_map(*film.flight.marker_position_m)) < 1.0


def test_the_marker_is_outlined_where_the_camera_has_it() -> None:
    near = SCENARIO.replace(marker_genes((0.0, -7.4), LAWN))
    flight = fly(near, Hovers, policy_spec("stationary"), time_limit_s=0.2)
    # Seen from straight above: half a side at focal 320 px from 3 m.
    uav = dataclasses.replace(
        flight.uav,
        position_m=np.tile([*flight.marker_position_m, 3.05], (len(flight.uav.time_s), 1)),
        attitude=np.tile([0.0, 0.0, 0.0, 1.0], (len(flight.uav.time_s), 1)),
    )
    above = dataclasses.replace(flight, uav=uav)
    picture = next(frames(above, near, LAWN, Hovers.airframe.camera))
    places = painted(picture[CAMERA_PART], MARKER)
    half = 0.75 * 320 / 3.0
    assert places.min(axis=0) == pytest.approx([319.5 - half, 239.5 - half], abs=1.5)
    assert places.max(axis=0) == pytest.approx([319.5 + half, 239.5 + half], abs=1.5)


def test_the_uav_is_drawn_where_it_is_on_the_map(film: Film) -> None:
    places = painted(film.pictures[-1][MAP_PART], UAV)
    x, y, _ = film.flight.uav.position_m[-1]
    assert math.dist(places.mean(axis=0), on_the_map(x, y)) < 3.0


def test_a_removed_npc_is_not_drawn(film: Film) -> None:
    assert len(painted(film.pictures[-1][MAP_PART], OBJECTS["dog"])) > 20
    assert len(painted(film.pictures[-1][MAP_PART], OBJECTS["person"])) > 20
    assert len(painted(film.pictures[-1][MAP_PART], OBJECTS["bird"])) == 0


def test_a_systems_beliefs_are_drawn_from_their_step_on(film: Film) -> None:
    silent, speaking = film.pictures[14], film.pictures[16]
    for part in (CAMERA_PART, MAP_PART):
        assert len(painted(silent[part], SYSTEM)) == 0
    outline = painted(speaking[CAMERA_PART], SYSTEM)
    assert (outline.min(axis=0) <= (100, 60)).all()
    assert any(math.dist(place, (180, 140)) < 2 for place in outline)
    beliefs = painted(speaking[MAP_PART], SYSTEM)
    for place in (TARGET, PLAN[1]):
        assert any(math.dist(each, on_the_map(*place[:2])) < 2 for each in beliefs)


def test_the_pictures_change_as_time_goes_by(film: Film) -> None:
    for part in (CAMERA_PART, STRIP, MAP_PART):
        assert (film.pictures[5][part] != film.pictures[25][part]).any()


def test_the_strip_shows_the_signature(film: Film) -> None:
    camera = Hovers.airframe.camera
    other = next(frames(film.flight, SCENARIO, LAWN, camera, "IV:dog:last-metre:seen"))
    assert (film.pictures[0][STRIP] != other[STRIP]).any()
    assert (film.pictures[0][CAMERA_PART] == other[CAMERA_PART]).all()


def test_the_end_of_a_collision_is_crossed_out(film: Film) -> None:
    hit = Contact(
        time_s=3.0,
        body="dog-1",
        kind="dog",
        body_class="dynamic",
        position_m=(-5.0, 5.0, 3.0),
        speed_mps=1.0,
        tilt_rad=0.0,
    )
    flight = dataclasses.replace(film.flight, outcome="collision", contacts=(hit,))
    *_, last = frames(flight, SCENARIO, LAWN, Hovers.airframe.camera)
    crossed = painted(last[MAP_PART], HIT)
    assert math.dist(crossed.mean(axis=0), on_the_map(-5.0, 5.0)) < 1.0
    assert len(painted(film.pictures[-1][MAP_PART], HIT)) == 0


def test_a_flight_that_never_began_has_an_end() -> None:
    flight = fly(SCENARIO, NeverBegins, policy_spec("stationary"), time_limit_s=1.0)
    assert not flight.steps
    pictures = list(frames(flight, SCENARIO, LAWN, Hovers.airframe.camera, "V:ZeroDivisionError"))
    assert len(pictures) == CLOSING_FRAMES


@pytest.mark.parametrize("shape", [(160, 120), (1280, 720), (200, 200)])
def test_any_camera_fits(film: Film, shape: tuple[int, int]) -> None:
    camera = Camera(width_px=shape[0], height_px=shape[1])
    picture = next(frames(film.flight, SCENARIO, LAWN, camera))
    assert picture.shape == (656, 1024, 3)
    lit = np.argwhere(picture[CAMERA_PART].any(axis=-1))
    height, width = lit.max(axis=0) - lit.min(axis=0) + 1
    assert width / height == pytest.approx(shape[0] / shape[1], rel=0.02)
    assert width == 640 or height == 480


def test_a_flight_of_another_scenario_is_refused(film: Film) -> None:
    camera = Hovers.airframe.camera
    elsewhere = SCENARIO.replace({"marker.x": -SCENARIO["marker.x"]})
    with pytest.raises(GarlError, match=r"its marker lay at .* take the scenario and the map"):
        next(frames(film.flight, elsewhere, LAWN, camera))
    fewer = SCENARIO.without("dog-1")
    with pytest.raises(GarlError, match=r"it has the objects .*dog-1.* map 'lawn' has person-1"):
        next(frames(film.flight, fewer, LAWN, camera))


def test_poses_between_two_samples_are_interpolated(film: Film) -> None:
    uav = Track(
        time_s=np.array([0.0, 1.0]),
        position_m=np.array([[0.0, 0.0, 1.0], [2.0, 4.0, 1.0]]),
        # A quarter turn about z, written with the other sign.
        attitude=np.array([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, -(0.5**0.5), -(0.5**0.5)]]),
        velocity_mps=np.zeros((2, 3)),
    )
    flight = dataclasses.replace(film.flight, uav=uav, objects=())
    middle = poses_at(flight, 0.5)
    assert middle.position_m == pytest.approx((1.0, 2.0, 1.0))
    assert middle.attitude == pytest.approx((0, 0, math.sin(math.pi / 8), math.cos(math.pi / 8)))
    assert middle.eye_m == pytest.approx((1.0, 2.0, 0.95))
    assert poses_at(flight, 9.0).position_m == (2.0, 4.0, 1.0)
    assert path_until(uav, 0.5).tolist() == [[0.0, 0.0, 1.0], [1.0, 2.0, 1.0]]


def test_browsers_play_the_file_at_the_flights_own_speed(film: Film, tmp_path: Path) -> None:
    path = tmp_path / "new" / "flight.mp4"
    save_video(path, film.flight, SCENARIO, LAWN, Hovers.airframe.camera, "II:lost:descent")
    assert list(path.parent.iterdir()) == [path]
    meta = described(path)
    assert (meta["codec"], meta["size"], meta["fps"]) == ("h264", (1024, 656), 10.0)
    assert meta["pix_fmt"].startswith("yuv420p")
    assert meta["duration"] == pytest.approx(FLOWN_S + 2.0, abs=0.05)
    content = path.read_bytes()
    assert content.index(b"moov") < content.index(b"mdat"), "plays only when wholly loaded"
    assert len(content) < 3e6 / 60 * meta["duration"]
    shown = list(decoded(path))
    assert len(shown) == len(film.pictures)
    for index in (0, 10, 29, 40):
        assert np.abs(shown[index].astype(int) - film.pictures[index]).mean() < 6
    assert np.abs(shown[5].astype(int) - shown[25]).mean() > 1


def described(path: Path) -> dict[str, Any]:
    reader = imageio_ffmpeg.read_frames(path)
    meta: dict[str, Any] = next(reader)
    reader.close()
    return meta


def decoded(path: Path) -> Iterator[Image]:
    video = cv2.VideoCapture(str(path))
    while True:
        there, picture = video.read()
        if not there:
            break
        yield np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), np.uint8)
    video.release()


def test_the_rate_is_the_recorded_one(film: Film) -> None:
    camera = Camera(rate_hz=50.0)
    steps = tuple(
        dataclasses.replace(step, time_s=index * 5 / 240)
        for index, step in enumerate(film.flight.steps)
    )
    assert rate_hz(dataclasses.replace(film.flight, steps=steps), camera) == 48.0
    assert rate_hz(dataclasses.replace(film.flight, steps=()), camera) == 50.0


def test_without_the_encoder_the_error_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(GarlError, match=r"pip install 'pytest-garl\[video\]'"):
        write([np.zeros((16, 16, 3), np.uint8)], tmp_path / "a.mp4", 10.0)


def test_an_encoder_that_fails_is_quoted_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = tmp_path / "ffmpeg"
    broken.write_text("#!/bin/sh\necho 'Unknown encoder' >&2\nexit 3\n")
    broken.chmod(0o755)
    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", lambda: str(broken))
    pictures = [np.zeros((656, 1024, 3), np.uint8)] * 5
    with pytest.raises(GarlError, match=r"exit status 3\): Unknown encoder"):
        write(pictures, tmp_path / "films" / "a.mp4", 10.0)
    assert not list((tmp_path / "films").iterdir())


@pytest.mark.parametrize(
    ("shapes", "words"),
    [
        ([], "at least one picture"),
        ([(15, 16, 3)], "16x15 pixels"),
        ([(16, 16, 3), (16, 32, 3)], "a film has one size"),
    ],
)
def test_pictures_that_make_no_film_are_refused(
    tmp_path: Path, shapes: list[tuple[int, ...]], words: str
) -> None:
    with pytest.raises(GarlError, match=words):
        write((np.zeros(shape, np.uint8) for shape in shapes), tmp_path / "a.mp4", 10.0)
    assert not list(tmp_path.iterdir())


def test_drawing_needs_neither_the_encoder_nor_pytest_nor_the_physics() -> None:
    code = (
        "import sys, pytest_garl.video\n"
        "print({'imageio_ffmpeg', 'pytest', 'pybullet'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
