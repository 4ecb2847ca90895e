"""Pictures of an experiment: box plots over the seeds, one panel for a figure on a map."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pytest_garl.experiments.metrics import (
    COVERAGE,
    DISTANCE,
    FIGURES,
    TOP10,
    VIOLATIONS,
    Figure,
    Sample,
    published,
    samples,
)
from pytest_garl.experiments.results import Row
from pytest_garl.experiments.spec import Experiment, Grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

LEAST_FOR_A_BOX = 3
"""Fewer searches are shown as points alone."""
COLOUR, PAPER = "#1f77b4", "#d95f02"
COLOURS = 64
"""So many colours has a picture."""


def draw(experiment: Experiment, grid: Grid, rows: Sequence[Row], path: Path) -> bool:
    """Draw a grid into a PNG file, the same bytes for the same rows; False if nothing was run."""
    from matplotlib.figure import Figure as Canvas

    found = samples(experiment, grid, rows)
    if not any(each.rows for each in found):
        return False
    lines = len(grid.systems) * len(grid.methods)
    size = (8.0, len(FIGURES) * (0.75 + 0.19 * lines))
    canvas = Canvas(figsize=size, dpi=100, layout="constrained")
    panels = canvas.subplots(len(FIGURES), len(grid.maps), squeeze=False, sharey=True)
    for column, map in enumerate(grid.maps):
        here = [each for each in found if each.map == map]
        for axes, figure in zip(panels[:, column], FIGURES, strict=True):
            _panel(axes, experiment, grid, here, figure)
    _save(canvas, path)
    return True


def _save(canvas: Canvas, path: Path) -> None:
    """Write the picture with few colours: a quarter of the bytes."""
    from PIL import Image

    buffer = io.BytesIO()
    canvas.savefig(buffer, format="png")
    path.parent.mkdir(parents=True, exist_ok=True)
    with Image.open(buffer) as image:
        few = image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    few.save(path, optimize=True)


def _panel(
    axes: Axes, experiment: Experiment, grid: Grid, found: Sequence[Sample], figure: Figure
) -> None:
    for place, each in enumerate(found):
        values = each.values(figure)
        if len(values) >= LEAST_FOR_A_BOX:
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
            # Whole, and above the axis, where a figure is 0.
            axes.plot(
                values,
                [place] * len(values),
                "o",
                color=COLOUR,
                markersize=3.5,
                clip_on=False,
                zorder=3,
            )
        theirs = _published(experiment, each, figure)
        if theirs is not None:
            axes.plot([theirs], [place], "x", color=PAPER, markersize=5, zorder=3)
    single = len(grid.systems) == 1
    names = [each.method if single else f"{each.system} {each.method}" for each in found]
    axes.set_yticks(range(len(found)), names, fontsize="x-small")
    axes.set_ylim(len(found) - 0.4, -0.6)
    if figure is not DISTANCE:
        # The margin at the far end is a share of what is shown, zero included.
        axes.update_datalim([(0.0, 0.0)], updatey=False)
        axes.autoscale_view(scaley=False)
        axes.set_xlim(left=0)
    axes.tick_params(axis="x", labelsize="x-small")
    axes.set_title(f"{figure.title}, {found[0].map}", loc="left", fontsize="small")
    axes.grid(axis="x", alpha=0.3)


def _published(experiment: Experiment, each: Sample, figure: Figure) -> float | None:
    """Return what others published for a panel, where it measures the same."""
    theirs = published(experiment, each)
    if theirs is None:
        return None
    if figure is TOP10:
        return theirs.top10 or None
    return {VIOLATIONS.title: theirs.violations, COVERAGE.title: theirs.coverage}.get(figure.title)
