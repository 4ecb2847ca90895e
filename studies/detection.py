"""The learned detector beside ArUco on the same pictures, by size, hiding and weather.

``python -m studies.detection`` renders the maps that are flown, from seeds that training never
saw, and writes ``docs/detection.md`` and ``docs/pictures/reliability.png``.  ``--without-court``
names weights that were trained without any court, to report the gap.
"""

from __future__ import annotations

import argparse
import itertools
import json
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from landing_systems.modules.detection_opencv import LOOKS, OpenCvDetector
from landing_systems.modules.detection_tphyolo.calibration import (
    Bin,
    calibration_error,
    reliability,
)
from landing_systems.modules.detection_tphyolo.decoding import CLASS_IDS, NETWORK_SIZE
from landing_systems.modules.detection_tphyolo.detector import TphYoloDetector, load_network
from landing_systems.modules.detection_tphyolo.weights import SHIPPED, read_weights
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
from pytest_garl.scenarios.maps.map import load_map

CONFIRM = 0.8
"""The decision's threshold."""
SEED = 778_000
"""The training was changed once after a look at errors in the pictures of seed 777,000."""
FRAMES = 12
IDS = (0, 0, 0, 1, 2, 3, 17)
"""Ids of the marker on the ground, in turn: the wanted one, the other classes, one of none."""
SIZES_PX = (14.0, 16.0, 24.0, 48.0, 96.0, 1000.0)
HIDDEN = (0.0, 0.05, 0.25, 0.50, 1.01)
LEGIBLE = 8.0
"""Grey levels between white and black; less is within a few times the sensor's noise."""
Detect = Callable[[Observation], Sequence[Detection]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """A marker in a picture, and which detectors confirmed it with its id."""

    map: str
    weather: Weather
    marker: Marker
    confirmed: frozenset[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """All markers that were to be found, and all detections, by detector."""

    frames: int
    sightings: list[Sighting]
    scored: dict[str, list[tuple[str, Weather, Scored]]]
    errors_m: dict[str, list[float]]


def aruco_once(observation: Observation) -> Sequence[Detection]:
    """Detect with a detector that has seen nothing before."""
    return OpenCvDetector(mission()).detect(observation)


def aruco_every_look(observation: Observation) -> Sequence[Detection]:
    """Look in all its ways, as it does over several frames of a flight."""
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


def recall(sightings: Iterable[Sighting], who: str) -> str:
    """Return the share of markers that a detector confirmed, as text."""
    hits = [who in each.confirmed for each in sightings]
    return f"{np.mean(hits):.3f}" if hits else "-"


def clear(marker: Marker) -> bool:
    """Whether a marker is wholly in the frame, large and legible, hidden or not."""
    return marker.framed > 0.99 and marker.contrast >= LEGIBLE and marker.side_px >= 16


def plain(marker: Marker) -> bool:
    """Whether a marker is one of those for which the targets are set."""
    return clear(marker) and marker.hidden <= 0.25


def sure_ones(scored: Sequence[tuple[str, Weather, Scored]]) -> list[Scored]:
    """Return the detections that the decision would confirm."""
    return [each for _, _, each in scored if each.detection.confidence >= CONFIRM]


def wrong_ids(sure: Sequence[Scored]) -> str:
    """Return how many and which share of detections have another marker's id, as text."""
    wrong = sum(each.kind == "wrong-id" for each in sure)
    return f"{wrong} of {len(sure)}: {100 * wrong / max(1, len(sure)):.2f} %"


def table(results: Results, names: Sequence[str]) -> list[str]:
    """Return the table by weather, hidden share and size."""
    whole = [
        each
        for each in results.sightings
        if each.marker.framed > 0.99 and each.marker.contrast >= LEGIBLE
    ]
    lines = ["| weather | hidden | side | markers | " + " | ".join(names) + " |"]
    lines.append("| --- | --- | --- | --- |" + " --- |" * len(names))
    for weather in ("confined", "full"):
        for low, high in itertools.pairwise(HIDDEN):
            for small, large in itertools.pairwise(SIZES_PX):
                chosen = [
                    each
                    for each in whole
                    if each.weather == weather
                    and low <= each.marker.hidden < high
                    and small <= each.marker.side_px < large
                ]
                if chosen:
                    hidden = f"{100 * low:.0f}-{min(100, 100 * high):.0f} %"
                    side = f"{small:.0f}-{large:.0f} px" if large < 1000 else f"> {small:.0f} px"
                    cells = " | ".join(recall(chosen, name) for name in names)
                    lines.append(f"| {weather} | {hidden} | {side} | {len(chosen)} | {cells} |")
    return lines


def summary(results: Results, names: Sequence[str]) -> list[str]:
    """Return the figures that have targets, and those that tell what else happens."""

    def chosen(test: Callable[[Marker], bool], map: str = "") -> list[Sighting]:
        return [each for each in results.sightings if test(each.marker) and map in ("", each.map)]

    groups = {
        "at least 16 px, at most 25 % hidden": chosen(plain),
        "the same, court": chosen(plain, "court"),
        "the same, lawn": chosen(plain, "lawn"),
        "the same, only id 0": chosen(lambda m: plain(m) and m.marker_id == 0),
        "5 to 25 % hidden": chosen(lambda m: clear(m) and 0.05 < m.hidden <= 0.25),
        "25 to 50 % hidden": chosen(lambda m: clear(m) and 0.25 < m.hidden <= 0.5),
        "half to nearly all in the frame, at most 25 % hidden": chosen(
            lambda m: 0.5 < m.framed <= 0.99 and m.contrast >= LEGIBLE and m.hidden <= 0.25
        ),
        f"contrast below {LEGIBLE:.0f} grey levels": chosen(
            lambda m: m.framed > 0.99 and m.contrast < LEGIBLE and m.hidden <= 0.25
        ),
    }
    lines = ["| recall | markers | " + " | ".join(names) + " |"]
    lines.append("| --- | --- |" + " --- |" * len(names))
    for title, group in groups.items():
        cells = " | ".join(recall(group, name) for name in names)
        lines.append(f"| {title} | {len(group)} | {cells} |")
    sure = {name: sure_ones(results.scored[name]) for name in names}
    ghosts = {name: sum(e.kind == "nothing-there" for e in sure[name]) for name in names}
    errors = {name: np.array(results.errors_m[name] or [np.nan]) for name in names}
    rows = {
        "wrong ids among confirmed, at least 16 px, at most 25 % hidden": [
            wrong_ids([e for e in sure[name] if e.marker is not None and plain(e.marker)])
            for name in names
        ],
        "wrong ids among all confirmed": [wrong_ids(sure[name]) for name in names],
        "false positives per frame": [f"{ghosts[name] / results.frames:.4f}" for name in names],
        "error in metres, median": [f"{np.median(errors[name]):.3f}" for name in names],
        "error in metres, 95 %": [f"{np.quantile(errors[name], 0.95):.3f}" for name in names],
    }
    for title, cells_of_row in rows.items():
        lines.append(f"| {title} | | " + " | ".join(cells_of_row) + " |")
    return lines


def inference_ms(detector: TphYoloDetector, repeats: int) -> tuple[float, float]:
    """Return the least and the median CPU time of a frame, networks and all."""
    map = load_map("court")
    picture = next(pictures(np.random.default_rng(SEED), map, "confined", 1))
    observation, times = observation_of(picture), []
    for _ in range(repeats):
        began = time.thread_time()
        detector.detect(observation)
        times.append(1000 * (time.thread_time() - began))
    return min(times), float(np.median(times))


def engines_ms(weights: Path, runs: int) -> tuple[float, float]:
    """Return the median milliseconds of CPU time of the first network: PyTorch's, OpenCV's.

    Both have the network that is shipped, with batch normalisation folded in; PyTorch's has
    random weights, which take as long.  The two are run in turn.
    """
    import torch

    from landing_systems.training.tphyolo.model import TphYolo, fused

    torch.set_num_threads(1)
    eager = fused(TphYolo())
    torch.nn.utils.convert_conv2d_weight_memory_format(eager, torch.channels_last)
    network = load_network(read_weights(weights).boxes)
    width, height = NETWORK_SIZE
    image = np.random.default_rng(0).random((1, 3, height, width), dtype=np.float32)
    tensor = torch.from_numpy(image).to(memory_format=torch.channels_last)
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(runs):
        began = time.thread_time()
        with torch.inference_mode():
            eager(tensor)
        times[0].append(1000 * (time.thread_time() - began))
        began = time.thread_time()
        network.setInput(image)
        network.forward()
        times[1].append(1000 * (time.thread_time() - began))
    return float(np.median(times[0])), float(np.median(times[1]))


def draw_reliability(bins: Sequence[Bin], file: Path) -> None:
    """Draw the reliability diagram."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.2, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color="0.7", linestyle="--")
    axes.plot([each.confidence for each in bins], [each.right for each in bins], marker="o")
    for each in bins:
        place = (each.confidence, each.right)
        axes.annotate(str(each.count), place, (4, -12), textcoords="offset points", fontsize=7)
    axes.set(xlabel="confidence", ylabel="share that is right", xlim=(0, 1), ylim=(0, 1))
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=90)


def weights_line(manifest: Path) -> str:
    """Return a line about the weights, from their manifest."""
    about = json.loads(manifest.read_text(encoding="utf-8"))
    line = f"Weights {about['sha256']['boxes'][:8]} and {about['sha256']['ids'][:8]}"
    return f"{line}; {about['note'].rstrip('.')}" if "note" in about else line


def main() -> None:
    """Evaluate, and write the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenarios", type=int, default=140, help="per map (default 140)")
    parser.add_argument("--weights", type=Path, default=SHIPPED)
    parser.add_argument("--without-court", type=Path, help="weights trained without the court")
    parser.add_argument("--docs", type=Path, default=Path("docs"))
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    detector = TphYoloDetector(mission(), arguments.weights)
    detectors: dict[str, Detect] = {
        "TPH-YOLO": detector.detect,
        "ArUco": aruco_once,
        "ArUco, four looks": aruco_every_look,
    }
    if arguments.without_court:
        other = TphYoloDetector(mission(), arguments.without_court)
        detectors["TPH-YOLO, no court"] = other.detect
    results = evaluate(detectors, arguments.scenarios)
    least, usual = inference_ms(detector, 200)
    eager, opencv = engines_ms(arguments.weights, 100)
    sure = [each for _, _, each in results.scored["TPH-YOLO"]]
    bins = reliability(
        [each.detection.confidence for each in sure], [each.kind == "right" for each in sure]
    )
    draw_reliability(bins, arguments.docs / "pictures" / "reliability.png")
    names = list(detectors)
    text = _REPORT.format(
        frames=results.frames,
        weights=weights_line(arguments.weights),
        scenarios=2 * arguments.scenarios,
        summary="\n".join(summary(results, names)),
        table="\n".join(table(results, names)),
        error=f"{calibration_error(bins):.3f}",
        least=f"{least:.1f}",
        usual=f"{usual:.1f}",
        eager=f"{eager:.1f}",
        opencv=f"{opencv:.1f}",
    )
    (arguments.docs / "detection.md").write_text(text, encoding="utf-8")
    print(text)


_REPORT = """# The learned marker detector beside ArUco

Written by `python -m studies.detection`: {frames} frames of {scenarios} random scenarios on the
maps of searches, from seeds and with ground textures that training never saw. {weights}. Heights
are 0.5 to 15 m, tilts up to 20°, with all headings, and people, dogs and birds on and around the
marker. Half of the scenarios are in the confined weather of searches. In the other half each
weather gene is drawn from its full range with a probability of a quarter. A marker counts as found
if a detection with its id and a confidence of at least 0.8 lies on it. Below 2 m the detector
ignores markers that touch the frame's edge, because it can only guess their middle. This costs
recall here and nothing in flight, because the UAV has come down over the marker. The hidden share
of a marker is the share that objects, leaves and snow on it cover. Flakes and leaves in the air do
not count; fog and darkness show in its contrast. "ArUco" is the detector of OpenCV-MLS on a single
frame. "Four looks" is what it would find if the UAV hung still and it tried all its ways to look.

{summary}

## Confidence

A confidence should be the share of correct detections. It was calibrated on invented places. Here
it is off by {error} on average (expected calibration error over ten bins).

![Reliability](pictures/reliability.png)

## Time

A frame of 320x240 takes {least} ms of CPU time at best and {usual} ms in the median, in total (one
thread; OpenCV's DNN, classic engine). The first network alone takes {opencv} ms, and {eager} ms in
PyTorch's eager mode.

## By weather, hidden share and size

The table counts markers that are wholly in the frame and whose white and black differ by at least 8
grey levels.

{table}
"""


if __name__ == "__main__":
    main()
