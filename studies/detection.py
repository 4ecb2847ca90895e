"""The learned detector compared with ArUco on equal pictures, by size, hidden share and weather.

``python -m studies.detection`` renders both maps from seeds that training never saw, and writes
``docs/detection.md`` and ``docs/pictures/reliability.png``.  ``--without-court`` names the
file of weights that were trained without any court, and reports the difference.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from landing_systems.modules.detection_tphyolo.calibration import (
    Bin,
    calibration_error,
    reliability,
)
from landing_systems.modules.detection_tphyolo.decoding import NETWORK_SIZE
from landing_systems.modules.detection_tphyolo.detector import TphYoloDetector, load_network
from landing_systems.modules.detection_tphyolo.weights import SHIPPED, read_weights
from landing_systems.training.tphyolo.scenes import (
    pictures,
)
from landing_systems.training.tphyolo.scoring import (
    mission,
    observation_of,
)
from pytest_garl.scenarios.maps.loading import load_map
from studies.detection_evaluation import SEED, Detect, aruco_every_look, aruco_once, evaluate
from studies.detection_tables import summary, table


def inference_ms(detector: TphYoloDetector, repeats: int) -> tuple[float, float]:
    """Return the least and the median CPU time of detection in a frame, including all networks."""
    map = load_map("court")
    picture = next(pictures(np.random.default_rng(SEED), map, "confined", 1))
    observation, times = observation_of(picture), []
    for _ in range(repeats):
        began = time.thread_time()
        detector.detect(observation)
        times.append(1000 * (time.thread_time() - began))
    return min(times), float(np.median(times))


def engines_ms(weights: Path, runs: int) -> tuple[float, float]:
    """Return the median CPU time of the first network in milliseconds: in PyTorch, in OpenCV.

    Both run the shipped network, with batch normalisation folded in.  In PyTorch it has random
    weights, which take as long.  The two runs alternate.
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
    least, median = inference_ms(detector, 200)
    eager, opencv = engines_ms(arguments.weights, 100)
    scored = [each for _, _, each in results.scored["TPH-YOLO"]]
    bins = reliability(
        [each.detection.confidence for each in scored], [each.kind == "right" for each in scored]
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
        median=f"{median:.1f}",
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

A frame of 320x240 takes {least} ms of CPU time at best and {median} ms in the median, in total (one
thread; OpenCV's DNN, classic engine). The first network alone takes {opencv} ms, and {eager} ms in
PyTorch's eager mode.

## By weather, hidden share and size

The table counts markers that are wholly in the frame and whose white and black differ by at least 8
grey levels.

{table}
"""


if __name__ == "__main__":
    main()
