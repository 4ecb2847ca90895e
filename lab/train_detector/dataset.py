"""Training pictures on disk: crops about markers, and whole frames as the network takes them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from lab.train_detector.grounds import HIGHEST_ID, invented_map
from lab.train_detector.scenes import Picture, Weather, pictures
from landing_systems.modules.detection_tphyolo.decoding import CLASS_IDS, NETWORK_SIZE
from landing_systems.modules.detection_tphyolo.detector import fitted, shrink
from landing_systems.modules.detection_tphyolo.patches import PADDING

CROP_PX = 144
"""A little more than a step learns from, so that it can shift the crop."""
MAX_MARKERS = 5
LABEL = 8
"""Centre x and y, width, height (pixel edges), id, hidden share, contrast, side in pixels;
rows without a marker have a width of 0."""
VERSION = 1
"""To be raised when the same plan gives other pictures."""
_RESIZE_JITTER = (0.75, 1.3)
Array = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True)
class DataPlan:
    """The settings of a data set.

    One shard holds pictures of ``scenarios`` random scenarios, in as many invented places as
    ``places``; every shard is a function of the plan and its number.
    """

    seed: int = 0
    court: bool = True
    shards: int = 40
    places: int = 6
    scenarios: int = 24
    frames_per_scenario: int = 24
    whole_frames: int = 3
    """So many of a scenario's frames are kept whole, for the last part of training."""

    @property
    def key(self) -> str:
        """Name of the folder that holds exactly this plan's pictures."""
        text = json.dumps({**asdict(self), "shards": 0, "version": VERSION}, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:12]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Samples:
    """Pictures with labels.

    ``images`` uint8 (n, H, W, 3), ``labels`` float32 (n, MAX_MARKERS, LABEL), ``regions``
    float32 (n, 4): left, top, right and bottom of what the camera saw; the rest is padding.
    """

    images: NDArray[np.uint8]
    labels: Array
    regions: Array


def render_all(
    plan: DataPlan, folder: Path, workers: int, on_progress: Callable[[int], None]
) -> None:
    """Render the shards that ``folder`` lacks; call ``on_progress`` with their number."""
    folder.mkdir(parents=True, exist_ok=True)
    missing = [index for index in range(plan.shards) if not _file(folder, index, "crops").exists()]
    on_progress(plan.shards - len(missing))
    tasks = [(plan, folder, index) for index in missing]
    if workers < 2 or len(tasks) < 2:
        for count, task in enumerate(tasks, 1):
            _render_shard(task)
            on_progress(plan.shards - len(missing) + count)
        return
    with get_context("spawn").Pool(workers) as pool:
        for count, _ in enumerate(pool.imap_unordered(_render_shard, tasks), 1):
            on_progress(plan.shards - len(missing) + count)


def load_shard(folder: Path, index: int, kind: str) -> Samples:
    """Return the ``crops`` or ``frames`` of a shard; images are read when they are looked at."""
    file = _file(folder, index, kind)
    with np.load(file.with_suffix(".npz"), allow_pickle=False) as rest:
        labels, regions = rest["labels"], rest["regions"]
    return Samples(images=np.load(file, mmap_mode="r"), labels=labels, regions=regions)


def _file(folder: Path, index: int, kind: str) -> Path:
    return folder / f"{kind}-{index:04d}.npy"


def _render_shard(task: tuple[DataPlan, Path, int]) -> None:
    plan, folder, index = task
    cv2.setNumThreads(1)
    crops, frames = shard(plan, index)
    for kind, samples in (("frames", frames), ("crops", crops)):
        file = _file(folder, index, kind)
        np.savez(file.with_suffix(".npz"), labels=samples.labels, regions=samples.regions)
        part = file.with_suffix(".part")
        with part.open("wb") as stream:
            np.save(stream, samples.images)
        # Only a whole shard gets its name: rendering may be interrupted at any time.
        part.rename(file)


def shard(plan: DataPlan, index: int) -> tuple[Samples, Samples]:
    """Render the crops and the whole frames of one shard."""
    rng = np.random.default_rng(np.random.SeedSequence(plan.seed, spawn_key=(index,)))
    crops: list[Sample] = []
    frames: list[Sample] = []
    for place in range(plan.places):
        map = invented_map(rng, index * plan.places + place, court=plan.court)
        for number in range(plan.scenarios // plan.places):
            weather: Weather = "full" if number % 2 else "confined"
            shots = pictures(rng, map, weather, plan.frames_per_scenario, marker_id=_marker_id(rng))
            for count, picture in enumerate(shots):
                if count < plan.whole_frames:
                    frames.append(whole(picture))
                crops.extend(_crops(rng, picture))
    return _stacked(crops), _stacked(frames)


Sample = tuple[NDArray[np.uint8], Array, Array]


def whole(picture: Picture) -> Sample:
    """Return a picture as the detector gives it to the network."""
    side = max((marker.side_px for marker in picture.markers), default=0.0)
    image, scale, (left, top) = fitted(picture.frame.image, side)
    height, width = picture.frame.image.shape[:2]
    region = np.array([left, top, left + scale * width, top + scale * height], np.float32)
    return image, _labels(picture, scale, (left, top), NETWORK_SIZE), region


def _crops(rng: np.random.Generator, picture: Picture) -> Iterator[Sample]:
    """Yield a crop about one or two of the markers, and now and then one of nothing special."""
    chosen = [marker for marker in picture.markers if marker.framed > 0.15]
    # Those of the classes first: the others are many.
    chosen.sort(key=lambda marker: marker.marker_id not in CLASS_IDS)
    centres = [marker.centre_px for marker in chosen[:2]]
    height, width = picture.frame.image.shape[:2]
    if not centres or rng.random() < 0.2:
        centres.append((float(rng.uniform(0, width)), float(rng.uniform(0, height))))
    sides = [marker.side_px for marker in picture.markers] or [float(rng.uniform(12, 64))]
    for centre in centres:
        jitter = float(np.exp(rng.uniform(*np.log(_RESIZE_JITTER))))
        yield _crop(picture, centre, jitter, max(sides), rng.uniform(0, 1, 2))


def _crop(
    picture: Picture,
    centre: tuple[float, float],
    jitter: float,
    side_px: float,
    where: NDArray[np.float64],
) -> Sample:
    """Cut so that ``centre`` lies at ``where`` in the crop, as far as the frame reaches."""
    image = picture.frame.image
    scale = min(1.0, jitter * shrink(side_px))
    if scale < 1:
        image = np.asarray(cv2.resize(image, None, None, scale, scale, cv2.INTER_AREA), np.uint8)
    height, width = image.shape[:2]
    result = np.full((CROP_PX, CROP_PX, 3), PADDING, np.uint8)
    spans = []
    for middle, size, share in ((centre[0], width, where[0]), (centre[1], height, where[1])):
        start = round(middle * scale - share * CROP_PX)
        # A frame that is larger fills the crop; a smaller one lies wholly inside.
        low, high = min(0, size - CROP_PX), max(0, size - CROP_PX)
        start = min(high, max(low, start))
        spans.append((start, max(0, start), min(size, start + CROP_PX)))
    (x, x_low, x_high), (y, y_low, y_high) = spans
    result[y_low - y : y_high - y, x_low - x : x_high - x] = image[y_low:y_high, x_low:x_high]
    region = np.array([x_low - x, y_low - y, x_high - x, y_high - y], np.float32)
    return result, _labels(picture, scale, (-x, -y), (CROP_PX, CROP_PX)), region


def _labels(
    picture: Picture, scale: float, shift: tuple[float, float], size: tuple[int, int]
) -> Array:
    labels = np.zeros((MAX_MARKERS, LABEL), np.float32)
    row = 0
    for marker in picture.markers:
        x, y = (scale * c + s for c, s in zip(marker.centre_px, shift, strict=True))
        width, height = (scale * each for each in marker.size_px)
        outside = (
            abs(x - size[0] / 2) > (size[0] + width) / 2
            or abs(y - size[1] / 2) > (size[1] + height) / 2
        )
        if outside or row == MAX_MARKERS:
            continue
        seen = (marker.hidden, marker.contrast, scale * marker.side_px)
        labels[row] = (x, y, width, height, marker.marker_id, *seen)
        row += 1
    return labels


def _marker_id(rng: np.random.Generator) -> int:
    """Half of the markers are the one that missions look for, a third others of the classes."""
    chance = rng.random()
    if chance < 0.5:
        return CLASS_IDS[0]
    if chance < 0.82:
        return int(rng.choice(CLASS_IDS[1:]))
    return int(rng.integers(len(CLASS_IDS), HIGHEST_ID + 1))


def _stacked(samples: list[Sample]) -> Samples:
    images, labels, regions = zip(*samples, strict=True)
    return Samples(images=np.stack(images), labels=np.stack(labels), regions=np.stack(regions))
