"""Train the marker detector: ``python -m lab.train_detector.train``.

Renders pictures of invented places (once; they are kept under ``.garl/``), learns from them,
calibrates the confidence on other invented places, and writes two ONNX files and a manifest.
Rendering takes some 5 minutes and learning some 45 on two cores; interrupted, it goes on.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import cv2
import numpy as np

from lab.train_detector.dataset import DataPlan, load_shard, render_all
from lab.train_detector.grounds import invented_map
from lab.train_detector.scenes import Picture, Weather, pictures
from lab.train_detector.scoring import mission, observation_of, score
from landing_systems.modules.detection_tphyolo import calibration
from landing_systems.modules.detection_tphyolo.decoding import NETWORK_SIZE
from landing_systems.modules.detection_tphyolo.detector import TphYoloDetector
from landing_systems.modules.detection_tphyolo.patches import PATCH_PX
from landing_systems.modules.detection_tphyolo.weights import SHIPPED, write_weights

if TYPE_CHECKING:
    from lab.train_detector.identity import IdentityNet, IdentityPlan

CALIBRATION_SEED = 1_000_000
"""Added to the training's seed: places in which the network has not learned."""
CALIBRATION_FRAMES = 12
PACKAGES = ("pytest-garl", "numpy", "opencv-python-headless", "torch", "onnx")
_TOLD_STEPS = 50


@click.command(help=__doc__)
@click.option(
    "--steps", type=click.IntRange(20), default=15000, show_default=True, help="Steps of learning."
)
@click.option(
    "--minutes",
    type=click.FloatRange(min=0.5),
    help="Instead of --steps: as many as this machine does in so many minutes.",
)
@click.option(
    "--reading-steps",
    type=click.IntRange(20),
    default=9000,
    show_default=True,
    help="Steps of the second network, which reads ids.",
)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True)
@click.option(
    "--without-court",
    is_flag=True,
    help="Leave concrete, painted lines and sports furniture out of training.",
)
@click.option("--shards", type=click.IntRange(1), default=40, show_default=True)
@click.option(
    "--calibration-scenarios",
    type=click.IntRange(1),
    default=120,
    show_default=True,
    help="Scenarios whose pictures calibrate the confidence.",
)
@click.option(
    "--workers",
    type=click.IntRange(1),
    default=min(16, os.cpu_count() or 1),
    help="Processes that render and threads that learn (default: one per core).",
)
@click.option(
    "--device", help="Where to learn, as PyTorch names it (default: cuda where there is one)."
)
@click.option(
    "--folder",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path(".garl/tphyolo"),
    show_default=True,
    help="Where pictures and checkpoints are kept.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    default=SHIPPED,
    help="Where the manifest (.json) goes; the networks (.onnx) go beside it.",
)
def main(
    steps: int,
    minutes: float | None,
    reading_steps: int,
    seed: int,
    without_court: bool,
    shards: int,
    calibration_scenarios: int,
    workers: int,
    device: str | None,
    folder: Path,
    out: Path,
) -> None:
    """Render, learn, calibrate, write."""
    import torch

    from lab.train_detector.export import onnx_bytes
    from lab.train_detector.identity import IdentityPlan
    from lab.train_detector.model import parameter_count
    from lab.train_detector.training import (
        TrainPlan,
        seconds_per_step,
        train,
    )

    began = time.perf_counter()
    device = device or ("cuda" if torch.cuda.is_available() else "cpu")
    data = DataPlan(seed=seed, court=not without_court, shards=shards)
    place = folder / data.key
    render_all(data, place, workers, lambda done: click.echo(f"rendered {done} of {shards} shards"))
    torch.set_num_threads(workers)
    plan = TrainPlan(steps=steps, seed=seed)
    if minutes is not None:
        pace = seconds_per_step(plan, place, device)
        plan = replace(plan, steps=max(20, round(60 * minutes / pace)))
    reading = IdentityPlan(steps=reading_steps, seed=seed)
    reader = _reader(reading, place, shards, device)
    finder = train(plan, place, shards, _teller("finding markers", plan.steps), device)
    width, height = NETWORK_SIZE
    networks = {
        "boxes": onnx_bytes(finder, (1, 3, height, width)),
        "ids": onnx_bytes(reader, (1, 3, PATCH_PX, PATCH_PX)),
    }
    about: dict[str, Any] = {
        "seed": seed,
        "without_court": without_court,
        "parameters": parameter_count(finder) + parameter_count(reader),
        "data": asdict(data),
        "training": asdict(plan),
        "reading": asdict(reading),
        "device": device,
        "versions": {name: importlib.metadata.version(name) for name in PACKAGES},
    }
    # What is shipped is replaced only by what has been calibrated.
    draft = place / "draft.json"
    write_weights(draft, networks, (1.0, 0.0), about)
    curve, about["calibrated_on"] = _calibrate(
        draft, seed, calibration_scenarios, not without_court
    )
    about["minutes_of_this_call"] = round((time.perf_counter() - began) / 60, 1)
    write_weights(out, networks, curve, about)
    size = sum(len(content) for content in networks.values()) / 1e6
    detections = about["calibrated_on"]["detections"]
    click.echo(f"{out}: {size:.2f} MB of weights, calibrated on {detections} detections")


def _calibrate(
    draft: Path, seed: int, scenarios: int, court: bool
) -> tuple[tuple[float, float], dict[str, float]]:
    """Return slope and offset of the confidences' curve, and what it was fitted on."""
    logits, right = calibration_set(draft, seed, scenarios, court=court)
    try:
        slope, offset = calibration.fit(logits, right)
    except ValueError as error:
        raise click.ClickException(str(error)) from error
    confidences = 1 / (1 + np.exp(-(slope * np.array(logits) + offset)))
    bins = calibration.reliability(confidences.tolist(), right)
    return (round(slope, 6), round(offset, 6)), {
        "detections": len(right),
        "right": sum(right),
        "error": round(calibration.calibration_error(bins), 4),
    }


def _reader(plan: IdentityPlan, place: Path, shards: int, device: str) -> IdentityNet:
    """Train the network that reads ids, or load it where this plan has trained it before."""
    import torch

    from lab.train_detector.identity import IdentityNet, train_identity

    file = place / f"reader-{_short(plan)}-{shards}.pt"
    if file.exists():
        model = IdentityNet().eval()
        model.load_state_dict(torch.load(file, weights_only=True))
        return model
    crops = [load_shard(place, index, "crops") for index in range(shards)]
    model = train_identity(plan, crops, _teller("reading ids", plan.steps), device)
    torch.save(model.state_dict(), file)
    return model


def _short(plan: IdentityPlan) -> str:
    """Name a plan in a few letters, another for every other plan."""
    return hashlib.sha256(json.dumps(asdict(plan), sort_keys=True).encode()).hexdigest()[:12]


def calibration_set(
    weights: Path, seed: int, scenarios: int, *, court: bool
) -> tuple[list[float], list[bool]]:
    """Return logits of detections in places of their own, and whether each is right.

    The weights' manifest must have the calibration (1, 0): confidences are then plain.
    """
    cv2.setNumThreads(1)
    detector = TphYoloDetector(mission(), weights, min_confidence=0.02)
    logits, right = [], []
    for index in range(scenarios):
        for picture in _calibration_pictures(seed, index, court):
            for each in score(picture, detector.detect(observation_of(picture))):
                # What rounds to 1 has a logit all the same.
                confidence = min(each.detection.confidence, 1 - 1e-12)
                logits.append(float(np.log(confidence / (1 - confidence))))
                right.append(each.kind == "right")
    return logits, right


def _calibration_pictures(seed: int, index: int, court: bool) -> list[Picture]:
    rng = np.random.default_rng([CALIBRATION_SEED + seed, index])
    weather: Weather = "full" if index % 2 else "confined"
    map = invented_map(rng, index, court=court)
    number = int(rng.choice([0, 0, 0, 1, 2, 3, int(rng.integers(4, 50))]))
    return list(pictures(rng, map, weather, CALIBRATION_FRAMES, marker_id=number))


def _teller(what: str, steps: int) -> Callable[[int, float], None]:
    recent: list[float] = []
    began = time.perf_counter()

    def tell(step: int, loss: float) -> None:
        recent.append(loss)
        if step % _TOLD_STEPS == 0 or step == steps:
            spent = (time.perf_counter() - began) / 60
            mean = sum(recent) / len(recent)
            click.echo(f"{what}: step {step} of {steps}, loss {mean:.3f}, {spent:.1f} min")
            recent.clear()

    return tell


if __name__ == "__main__":
    main()
