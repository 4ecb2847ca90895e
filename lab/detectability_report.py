"""The page about the detectability oracle: its tables and its reliability diagram."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.detectability_conditions import CONDITIONS, RANGES
from lab.detectability_fit import Bin, auc, brier, deciles, tenths
from lab.detectability_frames import DETECTORS, MAPS
from pytest_garl.scenarios.genes import SUN

Array = NDArray[np.float64]
WHOLE = 0.9
"""Share of the marker in the frame from which frames count in the calibration."""
ENOUGH = 500
"""A group of frames counts in the worst error from this size on."""
_BANDS: tuple[float, ...] = (0.0, 0.15, 0.4, 1.0)
_SHARES: tuple[float, ...] = (0.0, 0.3, 0.6, 1.0)
_SUN_BANDS: tuple[float, ...] = (0.0, 0.1, 0.3, 0.7, 0.9, 1.0)
"""Bands of a gene: confined, transition, and strong; night, low and high sun.  ``_SHARES`` are
those of a further condition, as shares of its range."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sample:
    """Held-out frames: predictions (n,), reads by each detector (n, 3), and what they show.

    ``by_size``, ``without_cover`` and ``constant`` are the predictions of baselines.
    """

    predicted: Array
    by_size: Array
    without_cover: Array
    constant: Array
    read_by: Array
    map: Array
    conditions: Array
    height_m: Array
    share_in_frame: Array
    hidden: Array
    px_per_module: Array

    @property
    def read(self) -> Array:
        """Whether any detector reads the frame."""
        read: Array = self.read_by.max(axis=1)
        return read

    def where(self, chosen: NDArray[np.bool_]) -> Sample:
        """Return some of the frames."""
        parts: dict[str, Any] = {name: getattr(self, name)[chosen] for name in Sample.__slots__}
        return Sample(**parts)


def groups(sample: Sample) -> Iterator[tuple[str, Sample]]:
    """Yield the frames by map, height, size, hidden share and bands of each condition."""
    for index, name in enumerate(MAPS):
        yield f"map {name}", sample.where(sample.map == index)
    for what, values, edges in (
        ("height", sample.height_m, (0.0, 1.5, 3.0, 6.0, 9.0, 12.0)),
        ("pixels per module", sample.px_per_module, (0.0, 3.0, 4.0, 6.0, 12.0, 100.0)),
        ("hidden share", sample.hidden, (0.0, 0.05, 0.15, 0.3, 1.0)),
    ):
        yield from _bands(sample, what, values, edges)
    for index, key in enumerate(CONDITIONS):
        name, values = key.removeprefix("environment."), sample.conditions[:, index]
        if key not in RANGES:
            yield from _bands(sample, name, values, _SUN_BANDS if key == SUN else _BANDS)
            continue
        share = values / RANGES[key][1]
        yield f"{name}, none", sample.where(share == 0)
        for low, high in itertools.pairwise(_SHARES):
            end = RANGES[key][1]
            chosen = (share > low) & (share <= high)
            yield f"{name}, {low * end:g} to {high * end:g}", sample.where(chosen)


def _bands(
    sample: Sample, name: str, values: Array, edges: tuple[float, ...]
) -> Iterator[tuple[str, Sample]]:
    for low, high in itertools.pairwise(edges):
        yield (
            f"{name}, {low:g} to {high:g}",
            sample.where((values >= low) & ((values < high) | (high == edges[-1]))),
        )


def score_rows(sample: Sample) -> list[str]:
    """Return the rows of AUC and Brier score, with baselines."""
    constant = np.full(len(sample.read), sample.constant.mean())
    return [
        f"| {name} | {auc(values, sample.read):.3f} | {brier(values, sample.read):.3f} |"
        for name, values in (
            ("oracle", sample.predicted),
            ("pixels per module alone, fitted alike", sample.by_size),
            ("pixels, contrast and noise alone, fitted alike", sample.without_cover),
            ("the mean of the frames that it was fitted to", constant),
        )
    ]


def bin_rows(bins: list[Bin]) -> list[str]:
    """Return a row per bin."""
    return [
        f"| {each.count} | {each.predicted:.3f} | {each.observed:.3f} | {each.error:+.3f} |"
        for each in bins
        if each.count
    ]


def worst_error(bins: list[Bin]) -> float:
    """Return the largest error of a bin with enough frames."""
    return max((abs(each.error) for each in bins if each.count >= ENOUGH), default=0.0)


def group_rows(sample: Sample) -> list[str]:
    """Return a row per group: frames, means, AUC, and the worst error of a tenth with enough."""
    rows = []
    for name, part in groups(sample):
        if not len(part.read):
            continue
        error = float(part.predicted.mean() - part.read.mean())
        rows.append(
            f"| {name} | {len(part.read)} | {part.predicted.mean():.3f} | {part.read.mean():.3f} "
            f"| {error:+.3f} | {auc(part.predicted, part.read):.3f} |"
        )
    return rows


def worst_groups(sample: Sample, count: int = 3) -> list[tuple[str, int, float]]:
    """Return the groups of enough frames whose mean prediction errs most."""
    found = [
        (name, len(part.read), float(part.predicted.mean() - part.read.mean()))
        for name, part in groups(sample)
        if len(part.read) >= ENOUGH
    ]
    return sorted(found, key=lambda each: -abs(each[2]))[:count]


def false_certainty(sample: Sample) -> tuple[float, int, float, int]:
    """Return the share not read of the frames with p >= 0.9, the share read of those <= 0.1."""
    sure, hopeless = sample.predicted >= 0.9, sample.predicted <= 0.1
    return (
        float(1 - sample.read[sure].mean()) if sure.any() else 0.0,
        int(sure.sum()),
        float(sample.read[hopeless].mean()) if hopeless.any() else 0.0,
        int(hopeless.sum()),
    )


def detector_rows(sample: Sample) -> list[str]:
    """Return the share of frames that each detector reads."""
    names = dict(
        zip(
            DETECTORS,
            ("ArUco, stock parameters", "ArUco of OpenCV-MLS, all its looks", "learned detector"),
            strict=True,
        )
    )
    rows = [
        f"| {names[name]} | {share:.3f} |"
        for name, share in zip(DETECTORS, sample.read_by.mean(axis=0), strict=True)
    ]
    return [*rows, f"| any of them | {sample.read.mean():.3f} |"]


def draw(sample: Sample, file: Path) -> None:
    """Draw the reliability diagram with the number of frames per tenth."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.6, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color="0.7", linestyle="--")
    axes.fill_between([0, 1], [-0.07, 0.93], [0.07, 1.07], color="0.93")
    for label, values, marker in (
        ("oracle", sample.predicted, "o"),
        ("size", sample.without_cover, "s"),
    ):
        bins = [each for each in tenths(values, sample.read) if each.count]
        axes.plot(
            [each.predicted for each in bins],
            [each.observed for each in bins],
            marker=marker,
            label="pixels, contrast and noise alone" if label == "size" else label,
        )
        for each in bins if label == "oracle" else ():
            axes.annotate(
                str(each.count),
                (each.predicted, each.observed),
                (4, -12),
                textcoords="offset points",
                fontsize=7,
            )
    axes.set(
        xlabel="predicted probability", ylabel="share of frames read", xlim=(0, 1), ylim=(0, 1)
    )
    axes.legend(loc="upper left", fontsize=8)
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=90)


def both_bins(sample: Sample) -> tuple[list[Bin], list[Bin]]:
    """Return tenths of the range, and groups of equal size."""
    return tenths(sample.predicted, sample.read), deciles(sample.predicted, sample.read)
