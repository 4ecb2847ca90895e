"""Spooling the motors up and down: idle first, then the throttle's limit opens."""

from __future__ import annotations

from typing import Literal

SpoolState = Literal["shut down", "ground idle", "spooling up", "unlimited", "spooling down"]


class Spool:
    """ArduPilot's spool states; each of the two ramps takes ``MOT_SPOOL_TIME``."""

    def __init__(self, spool_time_s: float, dt_s: float) -> None:
        self._step = dt_s / max(dt_s, spool_time_s)
        self.state: SpoolState = "shut down"
        self.top = 0.0
        """Greatest throttle that the motors may have, 0 to 1."""
        self._idle = 0.0

    def update(self, run: bool) -> SpoolState:
        """Advance one step towards running or towards standing still."""
        step = self._step
        if run:
            if self._idle < 1.0:
                self.state, self._idle = "ground idle", min(1.0, self._idle + step)
            elif self.top < 1.0:
                self.state, self.top = "spooling up", min(1.0, self.top + step)
            else:
                self.state = "unlimited"
        elif self.top > 0.0:
            self.state, self.top = "spooling down", max(0.0, self.top - step)
        elif self._idle > 0.0:
            self.state, self._idle = "ground idle", max(0.0, self._idle - step)
        else:
            self.state = "shut down"
        return self.state
