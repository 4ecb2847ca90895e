"""The detectability oracle: how probably a detector reads the marker in a frame."""

from __future__ import annotations

import math

from pytest_garl.simulation.flight import MarkerView

READABLE = 0.5
"""From this probability on a marker counts as readable in a frame."""


def readable_probability(view: MarkerView | None) -> float:
    """Return the probability that a detector of markers reads the frame.

    0 where the marker is not in the frame or there was no camera.  More pixels and more contrast
    never lower it; more that is hidden, noise, blur, clutter or uneven light never raises it.
    """
    if view is None or view.px_per_module <= 0:
        return 0.0
    size = view.px_per_module / math.sqrt(1 + (view.blur_px / view.px_per_module) ** 2)
    chance = _rises(6 * math.log2(size / 1.6)) if size > 0 else 0.0
    chance *= _rises((view.contrast / max(1.0, view.noise) - 6) / 1.5)
    chance *= _rises((0.24 - view.bits_hidden) / 0.04) * _rises((0.28 - view.border_hidden) / 0.04)
    chance *= _rises((view.share_in_frame - 0.97) / 0.01)
    return chance * _rises((0.3 - view.clutter) / 0.06)


def _rises(value: float) -> float:
    return 1 / (1 + math.exp(-max(-30.0, min(30.0, value))))
