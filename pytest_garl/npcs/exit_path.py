"""How an NPC leaves the marker when its part is over."""

from __future__ import annotations

import math

from pytest_garl.simulation.npc_policy import DECISION_STEP_S, STAY, Move, Situation

LANDING_ZONE_M = 5.0
"""Horizontal distance from the marker's centre at which an NPC is out of the way.  Engineering
estimate: half the UAV and half a bird's span are 1.2 m together; the rest is room to drift."""
STUCK = 0.1
"""An NPC that moves less in one decision than this share of its speed is blocked."""
_TURN_RAD = math.radians(70)
"""Not a divisor of a full turn, so that each attempt has another direction."""


class ExitPath:
    """The path out of a zone around the marker: straight on, or away from it if the NPC stood.

    An NPC that is blocked turns, first away from the marker, then further from there.  ``last`` is
    its last move.
    """

    def __init__(
        self, situation: Situation, last: tuple[float, float], zone_m: float = LANDING_ZONE_M
    ) -> None:
        self._zone_m = zone_m
        self._heading = math.atan2(last[1], last[0]) if any(last) else _away(situation)
        self._place: tuple[float, float] | None = None
        self._waited, self._turns = 0, 0
        self._has_left = False

    def decide(self, situation: Situation) -> Move:
        """Return the next move: at full speed until the NPC has left the zone."""
        x, y, _ = situation.self.position_m
        me = situation.self
        # A bird that stays where it is circles there.
        circle_m = 2 * me.type.turn_radius_m if me.speed_mps > 0 else 0.0
        away_m = math.dist((x, y), situation.marker_position_m)
        self._has_left |= away_m >= self._zone_m + circle_m
        if self._has_left:
            return STAY
        least = STUCK * situation.self.speed_mps * DECISION_STEP_S
        stuck = self._place is not None and math.dist((x, y), self._place) < least
        # Twice in a row, because an NPC that turns back stands for a moment.
        self._waited = self._waited + 1 if stuck else 0
        if self._waited == 2:
            self._heading = _away(situation) + self._turns * _TURN_RAD
            self._turns, self._waited = self._turns + 1, 0
        self._place = (x, y)
        return Move(x=math.cos(self._heading), y=math.sin(self._heading))


def _away(situation: Situation) -> float:
    """Return the direction from the marker to the NPC; east if it stands on the centre."""
    x, y, _ = situation.self.position_m
    mx, my = situation.marker_position_m
    return math.atan2(y - my, x - mx)
