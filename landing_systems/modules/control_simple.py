"""Decisions to setpoints for the simulator's simple flight control."""

from __future__ import annotations

from dataclasses import dataclass

from landing_systems.modules.decision import Decision
from pytest_garl import Abort, Command, Diagnostics, Land, PositionSetpoint, VelocitySetpoint


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedLimits:
    """Speeds in m/s: take-off as in the paper's code, transit so that frames overlap well."""

    take_off: float = 3.0
    transit: float = 4.0
    confirm: float = 1.5
    approach: float = 2.0
    descend: float = 1.2
    final_descend: float = 0.7
    final_height_m: float = 3.0
    land: float = 0.5
    """LAND_SPEED of ArduPilot."""


class SimpleControl:
    """Turns a decision into a command."""

    def __init__(self, limits: SpeedLimits | None = None) -> None:
        self._limits = limits or SpeedLimits()

    def command(
        self,
        decision: Decision,
        position_m: tuple[float, float, float],
        diagnostics: Diagnostics,
    ) -> Command:
        """Return the command for a decision."""
        limits = self._limits
        if decision.phase == "abort":
            return Abort(diagnostics=diagnostics)
        if decision.phase == "commit":
            return self._sink(decision, position_m, limits.land, diagnostics)
        if decision.phase == "descend":
            high = position_m[2] > limits.final_height_m
            rate = limits.descend if high else limits.final_descend
            rate = min(rate, max(0.0, position_m[2] - decision.goal_m[2]))
            return self._sink(decision, position_m, rate, diagnostics)
        speed = {
            "take-off": limits.take_off,
            "transit": limits.transit,
            "search": limits.transit,
            "confirm": limits.confirm,
        }.get(decision.phase, limits.approach)
        return PositionSetpoint(
            position_m=decision.goal_m, speed_mps=speed, diagnostics=diagnostics
        )

    def _sink(
        self,
        decision: Decision,
        position_m: tuple[float, float, float],
        rate_mps: float,
        diagnostics: Diagnostics,
    ) -> Command:
        """Descend while staying over the goal; on the ground say so."""
        if decision.phase == "commit" and position_m[2] < 0.3:
            return Land(speed_mps=rate_mps, diagnostics=diagnostics)
        vx, vy = (
            max(-1.0, min(1.0, 0.9 * (decision.goal_m[axis] - position_m[axis]))) for axis in (0, 1)
        )
        return VelocitySetpoint(velocity_mps=(vx, vy, -rate_mps), diagnostics=diagnostics)
