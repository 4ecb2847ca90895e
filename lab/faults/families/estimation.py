"""Faults of estimation: how sightings become a target."""

from __future__ import annotations

import math

from lab.faults.control import ControlSystem, Vector
from lab.faults.track import GATE_M, Place, Track
from pytest_garl import Command


class GateTrack(Track):
    """A track whose gate never opens again."""

    def note(self, now: float, spot: Place | None) -> None:
        """Note that a marker is in sight, then drop what is far from the target."""
        if spot is not None and self.target and math.dist(spot, self.target) > GATE_M:
            self.seen_s, spot = now, None
        super().note(now, spot)


class Gate(ControlSystem):
    """Rejects sightings far from its target for ever, also after the estimated position jumped.

    The report: setpoints are not shifted with the reset of the position's estimate.
    """

    track_of = GateTrack


class MeanTrack(Track):
    """A track that averages all sightings since the first."""

    def __init__(self) -> None:
        super().__init__()
        self._count = 0

    def note(self, now: float, spot: Place | None) -> None:
        """Take a sighting far away for noise as well."""
        if spot is None or self.target is None:
            super().note(now, spot)
            return
        self.target, self.seen_s = self.blended(self.target, spot), now

    def blended(self, target: Place, spot: Place) -> Place:
        """Return the mean of all."""
        self._count += 1
        share = 1 / (self._count + 1)
        return target[0] + share * (spot[0] - target[0]), target[1] + share * (spot[1] - target[1])


class Mean(ControlSystem):
    """Averages every sighting since the first, so that old ones never lose their weight.

    The report: the filter of the landing target runs on after the target was lost and found.
    """

    track_of = MeanTrack


class OnceTrack(Track):
    """A track that is locked by its first agreement."""

    def blended(self, target: Place, spot: Place) -> Place:
        """Keep the target."""
        return target


class Once(ControlSystem):
    """Locks the place of the pad when it confirms it, and does not correct it below.

    The report: the target is not updated below the height of the final descent.
    """

    track_of = OnceTrack


class Unfresh(ControlSystem):
    """Descends on the last sighting, however old it is.

    The report: the autopilot believes that it still has the target for seconds after the last
    measurement.
    """

    def land(self, now: float, at: Vector, target: Place) -> Command:
        """Land as if the pad had just been seen."""
        self.track.seen_s = now
        return super().land(now, at, target)
