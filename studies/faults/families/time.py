"""Faults of time: old sightings."""

from __future__ import annotations

from pytest_garl import Command
from studies.faults.control import ControlSystem, Vector
from studies.faults.track import Place


class Unfresh(ControlSystem):
    """Descends on the last sighting, however old it is.

    The report: the autopilot believes that it still has the target for seconds after the last
    measurement.
    """

    def land(self, now: float, at: Vector, target: Place) -> Command:
        """Land as if the pad had just been seen."""
        self.track.seen_s = now
        return super().land(now, at, target)
