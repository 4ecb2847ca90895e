"""The phases of a landing that stories of NPCs wait for."""

from __future__ import annotations

import math

PHASE_HEIGHTS_M = (8.0, 3.0, 0.1)
"""Heights of the feet above the ground that begin the phases after the start of the flight."""
DESCENT_HYSTERESIS_M = 0.5
"""A UAV sinks past a height if it was higher by this: it takes off from below."""


class LandingPhases:
    """Notes when each phase of :data:`~pytest_garl.scenarios.story.PHASES` began.

    A UAV that was never above a height has sunk past it when it sinks past the next one.
    """

    def __init__(self) -> None:
        self._peak_m = 0.0
        self._began_s = [0.0, *(math.inf for _ in PHASE_HEIGHTS_M)]

    @property
    def began_s(self) -> tuple[float, ...]:
        """When each phase began for the first time; infinite if it has not."""
        return tuple(self._began_s)

    def update(self, time_s: float, height_m: float) -> None:
        """Take in the height of the feet above the ground."""
        self._peak_m = max(self._peak_m, height_m)
        for number, limit_m in enumerate(PHASE_HEIGHTS_M, start=1):
            if height_m <= limit_m <= self._peak_m - DESCENT_HYSTERESIS_M:
                for each in range(1, number + 1):
                    self._began_s[each] = min(self._began_s[each], time_s)
