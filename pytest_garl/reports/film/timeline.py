"""The lower part of the picture: signature, time, phase, and the height over time."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import Flight, Step
from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.reports.film import drawing
from pytest_garl.reports.film.pose import Poses

WIDTH, HEIGHT = 640, 176
_LEFT, _RIGHT, _TOP, _BOTTOM = 44, WIDTH - 14, 62, 134
_TICK_SPACINGS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0)
_LEGEND = (
    (drawing.UAV, "UAV, its path, view (thick edge: top)"),
    (drawing.MARKER, "marker"),
    (drawing.SYSTEM, "system's detection, target, plan"),
)


class Timeline:
    """Draws the timeline of one flight; the parts that do not change are drawn once."""

    def __init__(self, flight: Flight, signature: str) -> None:
        self._flight, self._signature = flight, signature or "no violation"
        self._times = flight.uav.time_s
        self._heights = np.array(
            [feet_height_m(height) for height in flight.uav.position_m[:, 2].tolist()]
        )
        self._longest = max(float(flight.elapsed_s), 1.0)
        self._highest = max(float(self._heights.max()), 1.0)
        self._background = drawing.blank_picture(WIDTH, HEIGHT)
        self._draw_background()

    def draw(self, poses: Poses, step: Step | None, *, ended: bool = False) -> drawing.Image:
        """Return the timeline at one moment; an ``ended`` flight shows its outcome."""
        picture = self._background.copy()
        height = feet_height_m(float(poses.position_m[2]))
        past = self._times < poses.time_s
        line = self._pixels(self._times[past], self._heights[past])
        present = self._pixels(np.array([poses.time_s]), np.array([height]))
        drawing.line(picture, np.vstack([line, present]), drawing.UAV, 2)
        at = (float(present[0, 0]), float(present[0, 1]))
        drawing.disc(picture, at, 4.5, drawing.UAV)
        clock = f"{poses.time_s:.1f} s of {self._flight.elapsed_s:.1f} s"
        drawing.text(picture, clock, (_RIGHT - drawing.width_of(clock, 16), 24), size=16)
        if ended:
            drawing.text(
                picture, self._outcome(), (14, 48), drawing.HIT, 15, bold=True, max_width_px=470
            )
            if self._flight.outcome == "collision":
                drawing.cross(picture, at, 6, drawing.HIT, 2)
        elif step and step.diagnostics and step.diagnostics.phase:
            drawing.text(
                picture, f"phase: {step.diagnostics.phase}", (14, 48), size=15, max_width_px=470
            )
        words = f"height {height:.1f} m"
        drawing.text(picture, words, (_RIGHT - drawing.width_of(words, 15), 48), size=15)
        return picture

    def _outcome(self) -> str:
        flight = self._flight
        if flight.outcome == "collision" and flight.contacts:
            return f"collision with {flight.contacts[-1].body}"
        if flight.outcome == "crashed" and flight.crash:
            return f"the landing system crashed: {flight.crash.error} in {flight.crash.where}"
        if flight.outcome == "landed":
            return f"landed {flight.final_distance_m:.2f} m from the marker"
        return flight.outcome.replace("_", " ")

    def _pixels(
        self, times: NDArray[np.float64], heights: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        across = _LEFT + times / self._longest * (_RIGHT - _LEFT)
        return np.stack([across, _BOTTOM - heights / self._highest * (_BOTTOM - _TOP)], axis=1)

    def _draw_background(self) -> None:
        image = self._background
        drawing.text(image, self._signature, (14, 24), size=17, bold=True, max_width_px=450)
        for value in _ticks(self._highest, 4):
            _, y = self._pixels(np.zeros(1), np.array([value]))[0]
            drawing.line(image, np.array([[_LEFT, y], [_RIGHT, y]]), drawing.RULE, 1)
            words = f"{value:g} m"
            drawing.text(
                image, words, (_LEFT - 6 - drawing.width_of(words, 12), y + 4), drawing.FAINT, 12
            )
        for value in _ticks(self._longest, 9):
            x, y = self._pixels(np.array([value]), np.zeros(1))[0]
            drawing.line(image, np.array([[x, y], [x, y + 4]]), drawing.FAINT, 1)
            words = f"{value:g} s"
            drawing.text(
                image, words, (x - drawing.width_of(words, 12) / 2, y + 16), drawing.FAINT, 12
            )
        drawing.line(image, self._pixels(self._times, self._heights), drawing.RULE, 2)
        x = 14.0
        for colour, words in _LEGEND:
            drawing.disc(image, (x + 4, HEIGHT - 13), 5, colour)
            x = drawing.text(image, words, (x + 14, HEIGHT - 8), drawing.INK, 13) + 20


def _ticks(highest: float, most_ticks: int) -> list[float]:
    """Return round values from 0 to ``highest``, about ``most_ticks`` of them at most."""
    spacing = next((each for each in _TICK_SPACINGS if highest / each <= most_ticks), highest)
    return [index * spacing for index in range(math.floor(highest / spacing + 1e-9) + 1)]
