"""First-order low-pass filters in plain floats."""

from __future__ import annotations

import math


def smoothing(cutoff_hz: float, dt_s: float) -> float:
    """Return the share of a new sample: dt / (dt + 1 / (2 pi f)); 1 where the filter is off."""
    if cutoff_hz <= 0:
        return 1.0
    return dt_s / (dt_s + 1 / (2 * math.pi * cutoff_hz))
