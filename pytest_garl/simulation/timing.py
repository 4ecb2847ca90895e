"""When a frame reaches the landing system, and which frames are lost."""

from __future__ import annotations

from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.events import Event, Moments
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ
from pytest_garl.simulation.randomness import generator


class Timing:
    """The way of frames from the camera to the landing system: a queue that keeps their order.

    Times are in steps of the physics.  ``stamp_ticks`` is how much later than the picture the pose
    is that comes with it.
    """

    def __init__(self, scenario: Scenario, moments: Moments) -> None:
        self._latency_ms = scenario["timing.latency_ms"]
        self._jitter_ms = scenario["timing.jitter_ms"]
        self._lost_share = scenario["timing.dropped_percent"] / 100
        self.stamp_ticks = _ticks(scenario["timing.stamp_error_ms"])
        self._burst = Event(scenario, "burst", moments)
        self._burst_ms = scenario["burst.latency_ms"]
        self._rng = generator(scenario.seed, "timing")
        self._last_arrival = 0

    def jitter_ms(self) -> float | None:
        """Draw the jitter of the next frame; None if the frame is lost."""
        # Two draws for each frame, so that the same frames are lost whatever the jitter is.
        lost, share = self._rng.random(2)
        return None if lost < self._lost_share else float(share) * self._jitter_ms

    def arrival(self, tick: int, jitter_ms: float) -> int:
        """Return when a frame that sets out at ``tick`` reaches the landing system."""
        late_ms = self._latency_ms + jitter_ms
        if self._burst.happens(tick / PHYSICS_RATE_HZ):
            late_ms += self._burst_ms
        self._last_arrival = max(self._last_arrival, tick + _ticks(late_ms))
        return self._last_arrival


def _ticks(milliseconds: float) -> int:
    return round(milliseconds / 1000 * PHYSICS_RATE_HZ)
