"""Observability: when the camera first shows a moving body well enough to be noticed."""

from __future__ import annotations

import itertools

from pytest_garl.flight.flight import Flight, Step

OBSERVABLE_PX = 20
"""A body is observable if it has at least this many pixels in two successive frames: some four by
five pixels are what a detector of motion or of objects needs at least; engineering estimate."""


def first_observation_s(flight: Flight, body: str, since_s: float) -> float | None:
    """Return when a body is observable for the first time after ``since_s``; None if never.

    It is the time of the second of two successive frames that show it.
    """
    recent = [step for step in flight.steps if step.time_s >= since_s]
    for before, step in itertools.pairwise(recent):
        if min(pixels_of(before, body), pixels_of(step, body)) >= OBSERVABLE_PX:
            return step.time_s
    return None


def pixels_of(step: Step, body: str) -> int:
    """Return how many pixels of a body a frame shows."""
    shown = dict(zip(step.objects_visible, step.objects_px, strict=False))
    return shown.get(body, 0)
