"""A UAV that holds its place, from the side: from above, a plan straight down is a dot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import Flight, Step
from pytest_garl.reports.film import drawing
from pytest_garl.reports.film.pose import Poses
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placed import Placed

WIDTH, HEIGHT = 176, 150
"""Size of the view, in the lower left corner of the map."""
HALF_M = 4.0
"""How far east and west of the marker it shows."""
_LABEL_PX, _GROUND_PX = 22, 6
_LEAST_PX = 3.0
"""Smallest width and height of a body."""
Place = Sequence[float]


class SideView:
    """Draws marker, UAV, bodies, the planned path and the reported obstacles, seen from the south.

    ``draw`` changes the picture of the map.
    """

    def __init__(self, flight: Flight, placed: Placed) -> None:
        self._flight, self._marker = flight, placed.pad.main
        highest_m = float(flight.uav.position_m[:, 2].max()) + 1.0
        up_px = HEIGHT - _LABEL_PX - _GROUND_PX
        self._scale = min(WIDTH / (2 * HALF_M), up_px / highest_m)

    def draw(self, pane: drawing.Image, poses: Poses, step: Step | None) -> None:
        """Draw the view of one moment."""
        view = drawing.blank_picture(WIDTH, HEIGHT)
        x, _ = self._marker.place_m
        half = self._marker.side_m / 2
        self._line(view, [(x - HALF_M, 0.0, 0.0), (x + HALF_M, 0.0, 0.0)], drawing.FAINT, 1)
        self._line(view, [(x - half, 0.0, 0.0), (x + half, 0.0, 0.0)], drawing.MARKER, 4)
        for item, (place, _) in zip(self._flight.objects, poses.objects, strict=True):
            self._draw_body(view, item.type, place)
        said = step.diagnostics if step else None
        for place in (said.obstacles_m or ()) if said else ():
            drawing.square(view, self._pixel(place), drawing.OBSTACLE_PX, drawing.SYSTEM)
        if said and said.planned_path_m:
            self._line(view, said.planned_path_m, drawing.SYSTEM, 3)
        drawing.disc(view, self._pixel(poses.position_m), 5.0, drawing.UAV)
        drawing.text(view, "from the south", (6, 15), drawing.FAINT, 12)
        frame = np.array([[0, 0], [WIDTH - 1, 0], [WIDTH - 1, HEIGHT - 1], [0, HEIGHT - 1]])
        drawing.line(view, frame, drawing.RULE, 1, closed=True)
        pane[-HEIGHT:, :WIDTH] = view

    def _draw_body(self, view: drawing.Image, kind: str, place: Place) -> None:
        body = OBJECT_TYPES[kind]
        x, y = self._pixel((place[0], place[1], place[2] + body.low_m))
        half = max(_LEAST_PX, body.radius_m * self._scale)
        high = y - max(_LEAST_PX, body.height_m * self._scale)
        corners = np.array([(x - half, y), (x + half, y), (x + half, high), (x - half, high)])
        drawing.area(view, corners, drawing.OBJECTS.get(kind, drawing.INK))

    def _line(
        self, view: drawing.Image, places: Sequence[Place], colour: drawing.Colour, thickness: int
    ) -> None:
        points: NDArray[np.float64] = np.array([self._pixel(place) for place in places])
        drawing.line(view, points, colour, thickness)

    def _pixel(self, place: Place) -> drawing.Point:
        east_m = place[0] - self._marker.place_m[0]
        return WIDTH / 2 + east_m * self._scale, HEIGHT - _GROUND_PX - place[2] * self._scale
