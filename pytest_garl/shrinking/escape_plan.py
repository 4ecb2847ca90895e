"""Plans of escape: which way to fly from a moving body, tried one after the other on a model."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

from pytest_garl.shrinking.escape_model import EscapeModel
from pytest_garl.simulation.physics.flight_control import MAX_CLIMB_MPS, MAX_DESCENT_MPS
from pytest_garl.simulation.physics.vehicle import Vector
from pytest_garl.simulation.system_under_test.takeover import Leg

HOVERS_S = 3.0
"""An escape holds until this time after the contact."""
GONE_S = 1.0
"""The UAV flies on until this time after the contact, then it hovers."""
FIRST_LEG_S = 1.0
"""An escape in two parts goes aside for this time, then up."""
ASIDE_MPS = 8.0
"""Speed aside: as fast as the fastest body, a bird.  In the time of an escape the acceleration
limits the UAV, not this speed."""
SLOPES = (math.pi / 2, math.pi / 4, 0.0, -math.pi / 4, -math.pi / 2)
"""Up, halfway up, level, halfway down, down."""
TURNS = (0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 4.0)
"""Directions, in eighths of a turn, from straight away to straight towards the body."""
UP: Vector = (0.0, 0.0, MAX_CLIMB_MPS)


def find_escape(model: EscapeModel, body: str, contact_s: float) -> tuple[Leg, ...] | None:
    """Return the legs of the first escape from a body that the model holds for one; or None."""
    until_s = contact_s + HOVERS_S
    for legs in candidates(model.position_m(), model.position_m(body), contact_s - model.from_s):
        if model.escapes(legs, until_s):
            return legs
    return None


def candidates(uav: Vector, body: Vector, left_s: float) -> Iterator[tuple[Leg, ...]]:
    """Yield escapes from a body that will be hit after a time, the simplest first.

    First one direction until after the contact's time, then one direction for a second and up.
    """
    duration_s = left_s + GONE_S
    for velocity in directions(uav, body):
        yield (Leg(velocity_mps=velocity, duration_s=duration_s),)
    for velocity in directions(uav, body):
        if velocity != UP:
            yield (
                Leg(velocity_mps=velocity, duration_s=FIRST_LEG_S),
                Leg(velocity_mps=UP, duration_s=duration_s),
            )


def directions(uav: Vector, body: Vector) -> Iterator[Vector]:
    """Yield velocities within the flight control's limits of climb and descent."""
    away = math.atan2(uav[1] - body[1], uav[0] - body[0])
    for slope, turn in itertools.product(SLOPES, TURNS):
        if abs(slope) == math.pi / 2:
            if turn == 0.0:
                yield UP if slope > 0 else (0.0, 0.0, -MAX_DESCENT_MPS)
            continue
        heading = away + turn * math.pi / 4
        level = ASIDE_MPS * math.cos(slope)
        climb = min(MAX_CLIMB_MPS, max(-MAX_DESCENT_MPS, ASIDE_MPS * math.sin(slope)))
        yield level * math.cos(heading), level * math.sin(heading), climb
