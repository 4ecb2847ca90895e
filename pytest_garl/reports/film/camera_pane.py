"""The left part of the picture: the camera's view with the marker and what was detected."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import Step
from pytest_garl.landing_system import Detection
from pytest_garl.reports.film import drawing
from pytest_garl.reports.film.pose import Poses
from pytest_garl.simulation.camera.renderer import Renderer

WIDTH, HEIGHT = 640, 480


class CameraPane:
    """Draws frames of any camera, fitted into ``WIDTH`` by ``HEIGHT``."""

    def __init__(self, renderer: Renderer) -> None:
        self._renderer = renderer
        camera = renderer.camera
        self._scale = min(WIDTH / camera.width_px, HEIGHT / camera.height_px)
        self._size = (round(camera.width_px * self._scale), round(camera.height_px * self._scale))
        self._left = (WIDTH - self._size[0]) // 2
        self._top = (HEIGHT - self._size[1]) // 2

    def draw(self, poses: Poses, step: Step | None) -> drawing.Image:
        """Return the pane; ``step`` is the landing system's answer to this very frame."""
        eye = poses.eye_m(self._renderer.camera)
        frame = self._renderer.render(eye, poses.attitude, poses.time_s, poses.objects).image
        way = cv2.INTER_AREA if self._scale < 1 else cv2.INTER_LINEAR
        view = np.asarray(cv2.resize(frame, self._size, interpolation=way), np.uint8)
        seen = step.diagnostics.detections if step and step.diagnostics else ()
        # Thick below thin: where a detection is right both outlines can be seen.
        for detection in seen:
            self._detection(view, detection)
        outline = self._marker(poses)
        if len(outline) >= 3:
            drawing.line(view, outline, drawing.MARKER, 2, closed=True)
        pane = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
        pane[self._top : self._top + self._size[1], self._left : self._left + self._size[0]] = view
        return pane

    def _marker(self, poses: Poses) -> NDArray[np.float64]:
        eye = poses.eye_m(self._renderer.camera)
        return self._pixels(self._renderer.marker_outline(eye, poses.attitude))

    def _detection(self, view: drawing.Image, detection: Detection) -> None:
        words = f"id {detection.marker_id}  {detection.confidence:.2f}"
        if not detection.corners_px:
            return
        corners = self._pixels(np.array(detection.corners_px))
        drawing.line(view, corners, drawing.SYSTEM, 5, closed=True)
        low = corners[np.argmax(corners[:, 1])]
        drawing.label(view, words, (float(low[0]), float(low[1]) + 18), drawing.SYSTEM)

    def _pixels(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Turn the camera's pixels (n, 2) into the pane's: whole numbers are pixel centres."""
        return (np.asarray(points, np.float64) + 0.5) * self._scale - 0.5
