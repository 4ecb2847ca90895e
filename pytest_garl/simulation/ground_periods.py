"""Stays of the UAV on the ground: touchdown, slide, and whether it came to rest."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from pytest_garl.flight.flight import Outcome, Touchdown
from pytest_garl.flight.thresholds import HARD_TOUCHDOWN_MPS, SLID_M, UPRIGHT_RAD
from pytest_garl.simulation.land_detector import LandDetector
from pytest_garl.simulation.physics.vehicle import Vector, VehicleModel

if TYPE_CHECKING:
    from pytest_garl.simulation.recorder import Recorder

BOUNCE_S = 0.25
"""A shorter loss of contact does not end a stay.  A UAV that rebounds at 1 m/s, half the speed of
a hard touchdown, is in the air for 0.2 s."""
STILL_MPS = 0.2
WATCHED_S = 2.0
"""The flight goes on for this time after the motors stopped, or after a slide exceeded its limit:
so the record shows whether the UAV still moves."""


class GroundPeriods:
    """Follows the stays of the UAV on the ground; ``touchdowns`` has one per stay, in order.

    ``was_pushed`` is whether a moving body touched the UAV after its motors had stopped: how it
    moves from then on is no longer the landing system's doing, so the flight ends there.
    """

    def __init__(
        self,
        recorder: Recorder,
        model: VehicleModel,
        marker_m: tuple[float, float],
        surface: Callable[[tuple[float, float]], str],
    ) -> None:
        self._recorder, self._marker, self._surface = recorder, marker_m, surface
        self._detector = LandDetector(model)
        self._contact_s = -math.inf
        self._open = self.was_pushed = False
        self._slid_since_s: float | None = None
        self.touchdowns: list[Touchdown] = []

    @property
    def motors_stopped(self) -> bool:
        """Whether the motors have stopped for the rest of the flight."""
        return bool(self.touchdowns) and self.touchdowns[-1].stopped_s is not None

    @property
    def has_slid(self) -> bool:
        """Whether the UAV slid too far; nothing changes this outcome."""
        return self._slid_since_s is not None

    @property
    def since_s(self) -> float | None:
        """When the present stay began; None in the air."""
        return self.touchdowns[-1].time_s if self._open else None

    def update(
        self,
        time_s: float,
        contact_m: Vector | None,
        position: Vector,
        velocity: Vector,
        tilt_rad: float,
        thrust_n: float,
    ) -> Outcome | None:
        """Take one step of the physics; ``contact_m`` is where the UAV touches the ground, or None.

        Return the outcome of the flight once it is known.
        """
        if contact_m is not None:
            begins = not self._open
            self._contact_s = time_s
            if begins:
                self._begin(time_s, position, velocity, tilt_rad)
                self._recorder.contact("ground", contact_m, abs(velocity[2]), tilt_rad)
                if abs(velocity[2]) > HARD_TOUCHDOWN_MPS or tilt_rad > UPRIGHT_RAD:
                    return "collision"
        elif not self._open:
            return None
        elif time_s - self._contact_s > BOUNCE_S and not (self.motors_stopped or self.has_slid):
            self._open = False
        lands = self._detector.lands(time_s, self._open, thrust_n, velocity[2])
        if not self._open:
            return None
        if lands and not self.motors_stopped:
            self.touchdowns[-1] = dataclasses.replace(self.touchdowns[-1], stopped_s=time_s)
            self._recorder.event("motors_stopped", "the motors stopped on the ground")
        self._follow_slide(time_s, position, in_contact=contact_m is not None)
        return self._outcome(time_s, position, velocity, tilt_rad)

    def _begin(self, time_s: float, position: Vector, velocity: Vector, tilt_rad: float) -> None:
        self._open = True
        place = (position[0], position[1])
        self.touchdowns.append(
            Touchdown(
                time_s=time_s,
                position_m=position,
                distance_m=math.dist(place, self._marker),
                speed_mps=abs(velocity[2]),
                tilt_rad=tilt_rad,
                on=self._surface(place),
            )
        )

    def _follow_slide(self, time_s: float, position: Vector, *, in_contact: bool) -> None:
        if not in_contact or self.was_pushed:
            return
        touchdown = self.touchdowns[-1]
        moved = math.dist(position[:2], touchdown.position_m[:2])
        if moved > touchdown.slid_m:
            self.touchdowns[-1] = dataclasses.replace(touchdown, slid_m=moved)
        if moved > SLID_M and self._slid_since_s is None:
            self._slid_since_s = time_s
            motors = "stopped" if self.motors_stopped else "running"
            text = f"moved more than {SLID_M:g} m over the ground, with the motors {motors}"
            self._recorder.event("slid", text)

    def _outcome(
        self, time_s: float, position: Vector, velocity: Vector, tilt_rad: float
    ) -> Outcome | None:
        if self._slid_since_s is not None:
            return "slid" if time_s - self._slid_since_s >= WATCHED_S else None
        stopped_s = self.touchdowns[-1].stopped_s
        if stopped_s is None:
            return None
        if self.was_pushed:
            self._recorder.event("landed", "at rest on the ground until a moving body touched it")
            return "landed"
        if tilt_rad >= UPRIGHT_RAD:
            self._recorder.contact("ground", position, abs(velocity[2]), tilt_rad)
            return "collision"
        vx, vy, vz = velocity
        still = math.sqrt(vx * vx + vy * vy + vz * vz) < STILL_MPS
        if time_s - stopped_s < WATCHED_S or not still:
            return None
        self._recorder.event("landed", "at rest on the ground")
        return "landed"
