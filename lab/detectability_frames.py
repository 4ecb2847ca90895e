"""Frames of random scenarios for the detectability study: drawn, painted, and read by detectors."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from lab.detectability_conditions import CONDITIONS, random_conditions, random_movement
from landing_systems.modules.detection_opencv import LOOKS, OpenCvDetector
from landing_systems.modules.detection_tphyolo.detector import TphYoloDetector, ground_place
from pytest_garl.fiducial import MARKER_SIDE_M
from pytest_garl.flight.flight import MarkerView
from pytest_garl.landing_system import Camera, Detection, Mission, Observation
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import SUN, genome_for
from pytest_garl.scenarios.groups import WEATHER
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placed import MARKER_DICTIONARY, TARGET_MARKER_ID, Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.camera.cover_event import renderer_of
from pytest_garl.simulation.camera.projection import View, eye_under
from pytest_garl.simulation.camera.solids import BodyPose
from pytest_garl.simulation.landing_moments import LandingMoments

SEED = 260_000
MAPS = ("court", "lawn")
CAMERA = Camera()
Kind = Literal["usual", "blurred", "far", "cut", "cluttered"]
KINDS: tuple[Kind, ...] = ("usual", "blurred", "far", "cut", "cluttered")
"""The frames of the calibration; frames blurred as by motion; frames from so high up that modules
become smaller than those of any flight with this camera, as other cameras see them; frames whose
edge cuts most markers; frames with more in the air than falls in any flight."""
HEIGHTS_M = (0.5, 12.0)
"""From just above the ground to a little above the height of searches."""
FAR_M = (12.0, 45.0)
CUT_M = (0.25, 10.0)
USUAL_TILT_RAD, MOST_TILT_RAD = math.radians(6.0), math.radians(20.0)
FRAMES = 10
"""Frames of one scenario."""
RIGHT_WITHIN_M = MARKER_SIDE_M / 2
"""A detection is at the right place within half of the marker's side: its middle is on it."""
CONFIRMED = 0.8
"""Confidence from which the reference landing systems act on a detection."""
DETECTORS = ("stock", "good", "learned")


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadFrame:
    """A frame: its view, the detectors that read it, and where it comes from."""

    scenario: int
    map: str
    conditions: tuple[float, ...]
    height_m: float
    view: MarkerView
    read: tuple[bool, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DrawnFrame:
    """A frame and what its scene shows of the marker."""

    image: NDArray[np.uint8]
    observation: Observation
    marker_m: tuple[float, float]
    view: MarkerView


class Detectors:
    """The detectors of the study, each without memory of earlier frames."""

    def __init__(self, camera: Camera = CAMERA) -> None:
        cv2.setNumThreads(1)
        self._mission = Mission(
            gps_position_m=(0.0, 0.0),
            home_m=(0.0, 0.0, 0.0),
            search_altitude_m=10.0,
            marker_id=TARGET_MARKER_ID,
            marker_side_m=MARKER_SIDE_M,
            marker_dictionary=MARKER_DICTIONARY,
            camera=camera,
            time_limit_s=120.0,
        )
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, MARKER_DICTIONARY))
        self._stock = cv2.aruco.ArucoDetector(dictionary, cv2.aruco.DetectorParameters())
        # Near the ground the reference systems do not land on a marker that the frame cuts.  That
        # is a decision about landing; the marker is read.
        self._learned = TphYoloDetector(self._mission, min_confidence=CONFIRMED, whole_below_m=0.0)

    def read(self, frame: DrawnFrame) -> tuple[bool, ...]:
        """Return which of ``DETECTORS`` read the right id at the right place."""
        return self._stock_reads(frame), self._good_reads(frame), self._learned_reads(frame)

    def _stock_reads(self, frame: DrawnFrame) -> bool:
        grey = cv2.cvtColor(frame.image, cv2.COLOR_RGB2GRAY)
        corners, ids, _ = self._stock.detectMarkers(grey)
        # OpenCV gives None, not an empty array, where it finds nothing.
        numbers = np.ravel(ids) if len(corners) else ()
        for quad, number in zip(corners, numbers, strict=True):
            middle = np.asarray(quad, np.float32).reshape(4, 2).mean(axis=0) + 0.5
            found = ground_place(middle, self._mission.camera, frame.observation)
            if number == TARGET_MARKER_ID and found and _is_there(found[0], frame):
                return True
        return False

    def _good_reads(self, frame: DrawnFrame) -> bool:
        """Try all ways in which the detector of OpenCV-MLS looks at a frame."""
        detector = OpenCvDetector(self._mission)
        # Each call tries the first look and another one.
        return any(_is_right(detector.detect(frame.observation), frame) for _ in LOOKS[1:])

    def _learned_reads(self, frame: DrawnFrame) -> bool:
        return _is_right(self._learned.detect(frame.observation), frame)


def _is_right(found: Sequence[Detection], frame: DrawnFrame) -> bool:
    return any(
        each.marker_id == TARGET_MARKER_ID and _is_there(each.position_m[:2], frame)
        for each in found
    )


def _is_there(place_m: Sequence[float], frame: DrawnFrame) -> bool:
    return math.dist(place_m, frame.marker_m) <= RIGHT_WITHIN_M


def random_scenario(rng: np.random.Generator, map: Map) -> Scenario:
    """Draw a valid scenario over the full range of all conditions that change a picture.

    Some genes have any value and the others are confined or zero, because nothing could be read
    nearly anywhere if all were high at once.
    """
    genome = genome_for(map, weather="full")
    values = dict(zip(genome.keys, genome.random(rng), strict=True))
    names = [*WEATHER]
    strong = rng.choice(len(names), size=int(rng.choice([0, 1, 1, 2, 2, 3, 8])), replace=False)
    quiet = float(rng.choice([0.0, 0.15]))
    for index, key in enumerate(names):
        values[key] = rng.uniform(0, quiet)
        if index in strong:
            # Small values are where most genes decide whether a marker is read.
            values[key] = float(rng.uniform(0, 1) ** rng.choice([1.0, 2.0]))
    kind = rng.random()
    if kind < 0.3:
        values[SUN] = float(rng.choice([0.0, 1.0]) - rng.uniform(-0.12, 0.12)) % 1.0
    elif kind < 0.5:
        values[SUN] = float(rng.uniform(0.35, 0.65))
    chromosome = np.array([values[key] for key in genome.keys])
    seed = int(rng.integers(2**31))
    scenario = decode(chromosome, genome, map=map.name, seed=seed)
    return repair(scenario.replace(random_conditions(rng)), map)


def random_pose(
    rng: np.random.Generator, marker_m: tuple[float, float], kind: Kind
) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
    """Draw a pose from which most of the marker is in the frame, most of the time."""
    low, high = HEIGHTS_M
    height = float(rng.uniform(low, high))
    if rng.random() < 0.5:
        height = math.exp(rng.uniform(math.log(0.9), math.log(high)))
    if kind in ("far", "cut"):
        height = math.exp(rng.uniform(*np.log(FAR_M if kind == "far" else CUT_M)))
    tilt = min(MOST_TILT_RAD, abs(float(rng.normal(0, USUAL_TILT_RAD))))
    towards, yaw = (float(each) for each in rng.uniform(0, 2 * math.pi, 2))
    attitude = attitude_of(tilt, towards, yaw)
    half = CAMERA.focal_px * MARKER_SIDE_M / height / 2
    # The middle of the marker stays away from the edge by about half of its side.
    place = []
    for size in (CAMERA.width_px, CAMERA.height_px):
        room = max(0.02 * size, size / 2 - float(rng.uniform(0.7, 1.5)) * half)
        if kind == "cut":
            room = size / 2 + 0.5 * min(half, size / 2)
        place.append(size / 2 + float(rng.uniform(-room, room)))
    x, y, scale = View.of(CAMERA, (0.0, 0.0, height), attitude).ground_of_pixel @ (*place, 1.0)
    return (marker_m[0] - float(x / scale), marker_m[1] - float(y / scale), height), attitude


def attitude_of(
    tilt_rad: float, towards_rad: float, yaw_rad: float
) -> tuple[float, float, float, float]:
    """Return the attitude that tilts about a level axis of the body, then yaws about z."""
    sin, cos = math.sin(tilt_rad / 2), math.cos(tilt_rad / 2)
    around = towards_rad + yaw_rad / 2
    return (
        sin * math.cos(around),
        sin * math.sin(around),
        cos * math.sin(yaw_rad / 2),
        cos * math.cos(yaw_rad / 2),
    )


def random_objects(
    rng: np.random.Generator, map: Map, marker_m: tuple[float, float]
) -> list[BodyPose]:
    """Put each object on or beside the marker, or far away."""
    crowded, placed = rng.random() < 0.5, []
    for _, kind in map.present_objects:
        if crowded and rng.random() < 0.4:
            x, y = rng.normal(marker_m, 0.8)
        else:
            x, y = rng.uniform(4, 9, 2) * rng.choice([-1.0, 1.0], 2) + marker_m
        at = (float(x), float(y), OBJECT_TYPES[kind].altitude_m)
        placed.append((at, float(rng.uniform(0, 2 * math.pi))))
    return placed


def drawn_frames(number: int, kind: Kind) -> Iterator[tuple[DrawnFrame, Scenario]]:
    """Yield the painted frames of one scenario."""
    rng = np.random.default_rng([SEED, KINDS.index(kind), number])
    map = load_map(MAPS[number % len(MAPS)])
    scenario = random_scenario(rng, map)
    renderer = renderer_of(Placed(scenario, map), CAMERA, LandingMoments())
    for _ in range(FRAMES):
        position, attitude = random_pose(rng, renderer.marker_m, kind)
        objects = random_objects(rng, map, renderer.marker_m)
        eye = eye_under(position, attitude)
        time_s, movement = float(rng.uniform(0, 120)), random_movement(rng)
        frame = renderer.render(eye, attitude, time_s, objects, movement)
        view = frame.marker
        if view is None:
            continue
        image = frame.image
        if kind == "blurred":
            image, view = blur(rng, image, view)
        if kind == "cluttered":
            image, view = clutter(rng, image, view)
        observation = Observation(
            time_s=0.0,
            position_m=np.array(position),
            velocity_mps=np.zeros(3),
            attitude=np.array(attitude),
            image=image,
            depth_m=frame.depth_m,
        )
        yield (
            DrawnFrame(image=image, observation=observation, marker_m=renderer.marker_m, view=view),
            scenario,
        )


def blur(
    rng: np.random.Generator, image: NDArray[np.uint8], view: MarkerView
) -> tuple[NDArray[np.uint8], MarkerView]:
    """Return the picture as seen by a camera that turned or flew during the exposure."""
    length, angle = float(rng.uniform(0, 2.5) * view.px_per_module), float(rng.uniform(0, math.pi))
    steps = np.linspace(-length / 2, length / 2, max(2, math.ceil(2 * length) + 1))
    size = 2 * math.ceil(length / 2) + 3
    kernel = np.zeros((size, size), np.float32)
    for step in steps:
        u, v = size // 2 + step * math.cos(angle), size // 2 + step * math.sin(angle)
        left, top = math.floor(u), math.floor(v)
        for du, dv in ((0, 0), (0, 1), (1, 0), (1, 1)):
            kernel[top + dv, left + du] += (1 - abs(u - left - du)) * (1 - abs(v - top - dv))
    kernel /= kernel.sum()
    smooth = cv2.filter2D(image.astype(np.float32), -1, kernel)
    # Motion blurs the scene, not the sensor's noise: what the filter took of it is given back.
    lost = view.noise * math.sqrt(max(0.0, 1 - float((kernel**2).sum())))
    noisy = smooth + lost * rng.standard_normal(image.shape, dtype=np.float32)
    picture = np.clip(np.round(noisy), 0, 255).astype(np.uint8)
    return picture, dataclasses.replace(view, blur_px=round(length, 4))


def clutter(
    rng: np.random.Generator, image: NDArray[np.uint8], view: MarkerView
) -> tuple[NDArray[np.uint8], MarkerView]:
    """Return the picture with a share behind flakes, drops or leaves that hang in the air."""
    share, image = float(rng.uniform(0, 1)), image.copy()
    colour = ((236, 240, 246), (150, 155, 160), (176, 92, 28))[rng.integers(3)]
    radius = float(rng.uniform(0.2, 1.0)) * max(2.0, view.px_per_module)
    # Where discs fall anywhere, a place stays free with exp(-their area over the picture's).
    height, width = image.shape[:2]
    count = -math.log(max(1e-3, 1 - share)) * width * height / (math.pi * radius**2)
    for u, v in rng.uniform((0, 0), (width, height), (round(count), 2)):
        cv2.circle(image, (int(u), int(v)), round(radius), colour, -1, cv2.LINE_AA)
    whole = 1 - (1 - view.clutter) * (1 - share)
    return image, dataclasses.replace(view, clutter=round(whole, 4))


def read_frames(number: int, detectors: Detectors, kind: Kind = "usual") -> list[ReadFrame]:
    """Return the frames of one scenario, read by all detectors."""
    return [
        ReadFrame(
            scenario=number,
            map=scenario.map,
            conditions=tuple(scenario[key] for key in CONDITIONS),
            height_m=float(frame.observation.position_m[2]),
            view=frame.view,
            read=detectors.read(frame),
        )
        for frame, scenario in drawn_frames(number, kind)
    ]
