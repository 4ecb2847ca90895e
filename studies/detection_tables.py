"""Tables of the study on detection: recall and errors, by size, hidden share and weather."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from landing_systems.training.tphyolo.scenes import (
    Marker,
    Weather,
)
from landing_systems.training.tphyolo.scoring import (
    Scored,
)
from studies.detection_evaluation import CONFIRM, Results, Sighting

SIZES_PX = (14.0, 16.0, 24.0, 48.0, 96.0, 1000.0)
"""Bounds of the classes of size: the side of the marker in the image."""
HIDDEN = (0.0, 0.05, 0.25, 0.50, 1.01)
"""Bounds of the classes of the hidden share."""
LEGIBLE = 8.0
"""Smallest legible contrast in grey levels; less is near the sensor's noise."""


def recall(sightings: Iterable[Sighting], who: str) -> str:
    """Return the share of markers that a detector confirmed, as text."""
    hits = [who in each.confirmed for each in sightings]
    return f"{np.mean(hits):.3f}" if hits else "-"


def clear(marker: Marker) -> bool:
    """Whether a marker is wholly in the frame, large and legible, hidden or not."""
    return marker.framed > 0.99 and marker.contrast >= LEGIBLE and marker.side_px >= 16


def plain(marker: Marker) -> bool:
    """Whether a marker is clear and at most a quarter of it is hidden."""
    return clear(marker) and marker.hidden <= 0.25


def confirmed_detections(scored: Sequence[tuple[str, Weather, Scored]]) -> list[Scored]:
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
    """Return the table of recall and errors."""

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
    sure = {name: confirmed_detections(results.scored[name]) for name in names}
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
