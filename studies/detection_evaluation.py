"""Runs detectors of markers on the same rendered pictures and scores their detections."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from landing_systems.modules.detection_opencv import LOOKS, OpenCvDetector
from landing_systems.modules.detection_tphyolo.decoding import CLASS_IDS
from landing_systems.training.tphyolo.scenes import (
    Marker,
    Picture,
    Weather,
    pictures,
)
from landing_systems.training.tphyolo.scoring import (
    Scored,
    mission,
    observation_of,
    score,
)
from pytest_garl import Detection, Observation
from pytest_garl.scenarios.maps.loading import load_map

CONFIRM = 0.8
"""Confidence above which the decision module confirms a detection."""
SEED = 778_000
"""The training was changed once after a look at errors in the pictures of seed 777,000."""
FRAMES = 12
"""Frames of one scenario."""
IDS = (0, 0, 0, 1, 2, 3, 17)
"""Ids of the marker on the ground, in turn: the wanted one, the other classes, an unknown one."""
Detect = Callable[[Observation], Sequence[Detection]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """A marker in a picture, and the detectors that confirmed it with its id."""

    map: str
    weather: Weather
    marker: Marker
    confirmed: frozenset[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """All markers of known ids, and all detections and errors of each detector."""

    frames: int
    sightings: list[Sighting]
    scored: dict[str, list[tuple[str, Weather, Scored]]]
    errors_m: dict[str, list[float]]


def aruco_once(observation: Observation) -> Sequence[Detection]:
    """Detect with a new detector, which has no memory of earlier frames."""
    return OpenCvDetector(mission()).detect(observation)


def aruco_every_look(observation: Observation) -> Sequence[Detection]:
    """Detect with all variants of the image that the detector tries over several frames."""
    detector = OpenCvDetector(mission())
    return [item for _ in LOOKS for item in detector.detect(observation)]


def evaluate(detectors: dict[str, Detect], scenarios: int) -> Results:
    """Run all detectors on the same pictures of both maps in both weathers."""
    results = Results(
        frames=0,
        sightings=[],
        scored={name: [] for name in detectors},
        errors_m={name: [] for name in detectors},
    )
    frames = 0
    for map_index, name in enumerate(("court", "lawn")):
        map = load_map(name)
        for index in range(scenarios):
            rng = np.random.default_rng([SEED, map_index, index])
            weather: Weather = "full" if index % 2 else "confined"
            number = IDS[index // 2 % len(IDS)]
            for picture in pictures(rng, map, weather, FRAMES, marker_id=number):
                frames += 1
                _judge(results, detectors, name, picture)
    return Results(
        frames=frames,
        sightings=results.sightings,
        scored=results.scored,
        errors_m=results.errors_m,
    )


def _judge(results: Results, detectors: dict[str, Detect], name: str, picture: Picture) -> None:
    confirmed: dict[int, set[str]] = {id(marker): set() for marker in picture.markers}
    for who, detect in detectors.items():
        for each in score(picture, detect(observation_of(picture))):
            results.scored[who].append((name, picture.weather, each))
            sure = each.detection.confidence >= CONFIRM
            if sure and each.kind == "right" and each.marker is not None:
                confirmed[id(each.marker)].add(who)
                away = np.subtract(each.detection.position_m[:2], each.marker.place_m)
                results.errors_m[who].append(float(np.hypot(*away)))
    results.sightings.extend(
        Sighting(
            map=name,
            weather=picture.weather,
            marker=marker,
            confirmed=frozenset(confirmed[id(marker)]),
        )
        for marker in picture.markers
        if marker.marker_id in CLASS_IDS
    )
