"""The right part of the picture: the map from above, north up, with all paths so far."""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import HOLDS, Flight, ObjectRecord, Step
from pytest_garl.landing_system import Camera
from pytest_garl.reports.film import drawing
from pytest_garl.reports.film.labels import Labels
from pytest_garl.reports.film.pose import Poses, path_until
from pytest_garl.reports.film.side_view import SideView
from pytest_garl.scenarios.bodies import rotate
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.camera.ground import Raster, paint_ground
from pytest_garl.simulation.camera.ground_cover import cover_shift
from pytest_garl.simulation.camera.meshes import mesh_of, placed_hulls
from pytest_garl.simulation.camera.projection import View
from pytest_garl.simulation.camera.weather import conditions_of
from pytest_garl.simulation.randomness import generator

WIDTH, HEIGHT = 384, 656
MARGIN_M = 2.0
"""Width of the strip around the map's bounds that the pane also shows."""
_UAV_RADIUS_M = 0.5
_WHITE_SHARE = 0.62
"""Share of white that is mixed into the painted ground, so that paths stand out."""


class MapPane:
    """Draws the map of one flight; the parts that do not change are drawn once."""

    def __init__(self, flight: Flight, placed: Placed, camera: Camera) -> None:
        self._flight, self._map, self._camera = flight, placed.map, camera
        x_min, x_max, y_min, y_max = self._map.bounds_m
        across, up = x_max - x_min + 2 * MARGIN_M, y_max - y_min + 2 * MARGIN_M
        self._scale = min(WIDTH / across, HEIGHT / up)
        self._left = WIDTH / 2 - (x_min + x_max) / 2 * self._scale
        self._bottom = HEIGHT / 2 + (y_min + y_max) / 2 * self._scale
        self._marker = placed.pad.main
        self._background = self._ground(placed)
        self._draw_background()
        holds = any(event.name == HOLDS for event in flight.events)
        self._side_view = SideView(flight, placed) if holds else None

    def pixels(self, places_m: NDArray[Any]) -> NDArray[np.float64]:
        """Turn world places (n, 2 or 3) into the pane's pixels (n, 2)."""
        places = np.asarray(places_m, np.float64)
        return np.stack(
            [
                self._left + places[:, 0] * self._scale,
                self._bottom - places[:, 1] * self._scale,
            ],
            axis=1,
        )

    def draw(self, poses: Poses, step: Step | None, *, ended: bool = False) -> drawing.Image:
        """Return the pane at one moment; an ``ended`` flight shows what the UAV touched."""
        pane = self._background.copy()
        self._draw_footprint(pane, poses)
        for item in self._flight.objects:
            path = self.pixels(path_until(item.track, poses.time_s))
            drawing.line(pane, path, _colour(item), 1)
        drawing.line(pane, self.pixels(path_until(self._flight.uav, poses.time_s)), drawing.UAV, 2)
        self._draw_diagnostics(pane, step)
        self._write_names(pane, poses)
        for item, (place, yaw) in zip(self._flight.objects, poses.objects, strict=True):
            self._draw_disc_with_heading(pane, place, yaw, _radius_m(item), _colour(item))
        nose = rotate(poses.attitude, (1.0, 0.0, 0.0))
        yaw = math.atan2(nose[1], nose[0])
        self._draw_disc_with_heading(pane, poses.position_m, yaw, _UAV_RADIUS_M, drawing.UAV)
        if self._side_view:
            self._side_view.draw(pane, poses, step)
        if ended:
            for contact in self._flight.contacts[-1:]:
                drawing.cross(pane, self._pixel(contact.position_m), 9, drawing.HIT)
        return pane

    def _pixel(self, place_m: tuple[float, ...]) -> drawing.Point:
        x, y = self.pixels(np.array([place_m]))[0]
        return float(x), float(y)

    def _ground(self, placed: Placed) -> drawing.Image:
        """Return the ground as it was painted for the flight, mixed with white."""
        scenario = placed.scenario
        shift = cover_shift(generator(scenario.seed, "sensor"))
        wide = paint_ground(placed.map, conditions_of(scenario), shift, placed.pad).wide
        origin = self._left, self._bottom
        rgb = ground_from_above(wide, origin, self._scale, (WIDTH, HEIGHT))
        return np.asarray(
            cv2.addWeighted(rgb, 1 - _WHITE_SHARE, rgb, 0.0, 255 * _WHITE_SHARE), np.uint8
        )

    def _draw_background(self) -> None:
        image = self._background
        x_min, x_max, y_min, y_max = self._map.bounds_m
        corners = np.array([[x_min, y_min], [x_max, y_min], [x_max, y_max], [x_min, y_max]])
        drawing.line(image, self.pixels(corners), drawing.FAINT, 1, closed=True)
        for body in self._map.bodies:
            hulls = placed_hulls(mesh_of(body.parts), body.position_m, body.yaw_rad)
            tops = [float(hull[:, 2].max()) for hull in hulls]
            for _, hull, part in sorted(
                zip(tops, hulls, body.parts, strict=True), key=lambda each: each[0]
            ):
                outline = cv2.convexHull(self.pixels(hull).astype(np.float32)).reshape(-1, 2)
                r, g, b = ((2 * value + 255) // 3 for value in part.colour)
                drawing.area(image, outline, (r, g, b))
                drawing.line(image, outline, part.colour, 1, closed=True)
        square = self.pixels(np.array(self._marker.outline_m))
        drawing.line(image, square, drawing.MARKER, 3, closed=True)
        self._draw_scale_bar()

    def _draw_scale_bar(self) -> None:
        end = np.array([WIDTH - 12.0, HEIGHT - 12.0])
        bar = np.array([end - (5 * self._scale, 0), end])
        drawing.line(self._background, bar, drawing.INK, 2)
        drawing.label(
            self._background, "5 m", (bar[0, 0] + 2 * self._scale, end[1] - 7), drawing.INK, 12
        )
        drawing.label(self._background, "N", (12, 22), drawing.INK)
        arrow = np.array([[16.0, 58], [16, 30], [11, 38], [16, 30], [21, 38]])
        drawing.line(self._background, arrow, drawing.INK, 2)

    def _draw_footprint(self, pane: drawing.Image, poses: Poses) -> None:
        """Outline the ground in view, with a thick upper edge, unless the horizon is in view."""
        view = View.of(self._camera, poses.eye_m(self._camera), poses.attitude)
        right, low = self._camera.width_px - 0.5, self._camera.height_px - 0.5
        corners = np.array([[-0.5, -0.5, 1], [right, -0.5, 1], [right, low, 1], [-0.5, low, 1]])
        ground = view.ground_of_pixel @ corners.T
        if (ground[2] < 0).all():
            outline = self.pixels((ground[:2] / ground[2]).T)
            drawing.line(pane, outline, drawing.VIEW, 1, closed=True)
            drawing.line(pane, outline[:2], drawing.VIEW, 4)

    def _draw_diagnostics(self, pane: drawing.Image, step: Step | None) -> None:
        diagnostics = step.diagnostics if step else None
        if diagnostics is None:
            return
        for place in diagnostics.obstacles_m or ():
            drawing.square(pane, self._pixel(place), drawing.OBSTACLE_PX, drawing.SYSTEM)
        if diagnostics.planned_path_m:
            drawing.line(pane, self.pixels(np.array(diagnostics.planned_path_m)), drawing.SYSTEM, 3)
        if diagnostics.target_m is not None:
            drawing.cross(pane, self._pixel(diagnostics.target_m), 10, drawing.SYSTEM)

    def _write_names(self, pane: drawing.Image, poses: Poses) -> None:
        labels = Labels(pane)
        half = self._marker.side_m / 2
        labels.keep_clear(self._pixel(self._flight.marker_position_m), half * self._scale)
        labels.keep_clear(self._pixel(poses.position_m), _UAV_RADIUS_M * self._scale)
        names = [(name, (x, y), half, drawing.INK) for name, x, y in self._flight.decoys]
        for item, ((x, y, _), _) in zip(self._flight.objects, poses.objects, strict=True):
            names.append((item.name, (x, y), _radius_m(item), _colour(item)))
        for _, place, radius, _ in names:
            labels.keep_clear(self._pixel(place), radius * self._scale)
        for name, place, radius, colour in names:
            labels.write(name, self._pixel(place), radius * self._scale, colour)

    def _draw_disc_with_heading(
        self,
        pane: drawing.Image,
        place_m: tuple[float, float, float],
        yaw_rad: float,
        radius_m: float,
        colour: drawing.Colour,
    ) -> None:
        """Draw a disc with a line from its centre that shows the heading."""
        at, radius = self._pixel(place_m), max(4.0, radius_m * self._scale)
        drawing.disc(pane, at, radius + 1.5, drawing.BACKGROUND)
        drawing.disc(pane, at, radius, colour)
        nose = (at[0] + radius * math.cos(yaw_rad), at[1] - radius * math.sin(yaw_rad))
        drawing.line(pane, np.array([at, nose]), drawing.BACKGROUND, 2)


def _colour(item: ObjectRecord) -> drawing.Colour:
    return drawing.OBJECTS.get(item.type, drawing.INK)


def _radius_m(item: ObjectRecord) -> float:
    return OBJECT_TYPES[item.type].radius_m


def ground_from_above(
    wide: Raster,
    origin_px: tuple[float, float],
    px_per_m: float,
    size_px: tuple[int, int],
) -> drawing.Image:
    """Return painted ground from above, north up, RGB (H, W, 3).

    ``origin_px`` is the pixel of the world's origin, ``size_px`` the picture's width and height.
    """
    coarseness = round(math.log2(max(1.0, 1 / px_per_m / wide.m_per_px)))
    level = min(coarseness, len(wide.levels) - 1)
    left, bottom = origin_px
    world_of_picture = np.array(
        [
            [1 / px_per_m, 0.0, -left / px_per_m],
            [0.0, -1 / px_per_m, bottom / px_per_m],
            [0.0, 0.0, 1.0],
        ]
    )
    painted = cv2.warpPerspective(
        wide.levels[level],
        wide.pixel_of_world(level) @ world_of_picture,
        size_px,
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REFLECT_101,
    )
    return np.asarray(cv2.cvtColor(painted, cv2.COLOR_RGBA2RGB), np.uint8)
