"""Pictures of an experiment: box plots over the seeds, one panel for a metric on a map."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from lab.experiment.metrics import (
    DISTANCE,
    METRICS,
    MethodSearches,
    Metric,
    searches_in_grid,
)
from lab.experiment.results import ResultRow
from lab.experiment.spec import Experiment, Grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SEARCHES_FOR_A_BOX = 3
"""A method with fewer searches is shown as points without a box."""
COLOUR = "#1f77b4"
COLOURS = 64
"""Number of colours of a picture."""


def draw_grid(experiment: Experiment, grid: Grid, rows: Sequence[ResultRow], path: Path) -> bool:
    """Draw a grid into a PNG file; return False if there is no row.

    Equal rows give equal bytes.
    """
    from matplotlib.figure import Figure

    found = searches_in_grid(experiment, grid, rows)
    if not any(each.rows for each in found):
        return False
    row_count = len(grid.systems) * len(grid.methods)
    size = (8.0, len(METRICS) * (0.75 + 0.19 * row_count))
    figure = Figure(figsize=size, dpi=100, layout="constrained")
    panels = figure.subplots(len(METRICS), len(grid.maps), squeeze=False, sharey=True)
    for column, map in enumerate(grid.maps):
        on_map = [each for each in found if each.map == map]
        for axes, metric in zip(panels[:, column], METRICS, strict=True):
            _panel(axes, grid, on_map, metric)
    _save(figure, path)
    return True


def _save(figure: Figure, path: Path) -> None:
    """Write the picture with :data:`COLOURS` colours, which takes a quarter of the bytes."""
    from PIL import Image

    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    path.parent.mkdir(parents=True, exist_ok=True)
    with Image.open(buffer) as image:
        reduced = image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    reduced.save(path, optimize=True)


def _panel(axes: Axes, grid: Grid, found: Sequence[MethodSearches], metric: Metric) -> None:
    for place, each in enumerate(found):
        values = each.values(metric)
        if len(values) >= SEARCHES_FOR_A_BOX:
            axes.boxplot(
                [values],
                positions=[place],
                orientation="horizontal",
                widths=0.6,
                whis=(0, 100),
                manage_ticks=False,
                medianprops={"color": COLOUR},
            )
        if values:
            # Points at 0 lie on the axis, so they are not clipped and drawn above it.
            axes.plot(
                values,
                [place] * len(values),
                "o",
                color=COLOUR,
                markersize=3.5,
                clip_on=False,
                zorder=3,
            )
    single = len(grid.systems) == 1
    names = [each.method if single else f"{each.system} {each.method}" for each in found]
    axes.set_yticks(range(len(found)), names, fontsize="x-small")
    axes.set_ylim(len(found) - 0.4, -0.6)
    if metric is not DISTANCE:
        # The margin at the far end is a share of the range from zero.
        axes.update_datalim([(0.0, 0.0)], updatey=False)
        axes.autoscale_view(scaley=False)
        axes.set_xlim(left=0)
    axes.tick_params(axis="x", labelsize="x-small")
    axes.set_title(f"{metric.title}, {found[0].map}", loc="left", fontsize="small")
    axes.grid(axis="x", alpha=0.3)
