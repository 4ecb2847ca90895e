"""How long a flight takes, for the forecast of a session."""

from __future__ import annotations

import math
from typing import NamedTuple


class FlightTime(NamedTuple):
    """Wall time of one flight on one core, in seconds: a range where no earlier run tells it."""

    fastest: float
    slowest: float

    @property
    def typical(self) -> float:
        """Their geometric mean."""
        return math.sqrt(self.fastest * self.slowest)


FIRST_RUN = FlightTime(1.3, 3.9)
"""OpenCV-MLS, and three times as much: MM-MLS, or OpenCV-MLS on a core half as fast."""
