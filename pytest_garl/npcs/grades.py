"""The grades of behaviour: what an NPC of each perceives of the UAV, how often it decides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeLimits:
    """The limits of one grade that interferes.

    It perceives the UAV if that is at most ``sees_within_m`` away and nothing solid stands between
    them; it learns of it ``delay_s`` late, and decides every ``decides_every_s``.  On purpose it
    comes no nearer than ``keeps_m`` to where it believes the UAV's column to be.
    """

    sees_within_m: float
    delay_s: float
    decides_every_s: float
    keeps_m: float = 0.0
    intention: str


GRADE_LIMITS: Mapping[str, GradeLimits] = {
    "curious": GradeLimits(
        # Somebody hears and sees a UAV of 2 to 3 kg from there: engineering estimate.
        sees_within_m=10.0,
        # Perceiving and deciding takes drivers 1 to 1.5 s (Green 2000).
        delay_s=1.0,
        decides_every_s=2.0,
        # People felt uncomfortable nearer than 2 m to a UAV (Abioye et al. 2024).
        keeps_m=2.0,
        intention="comes near, stops, looks; never under the rotors on purpose",
    ),
    "chasing": GradeLimits(
        sees_within_m=20.0,
        # Twice a simple reaction to something seen, 0.25 s.
        delay_s=0.5,
        decides_every_s=0.5,
        intention="pursues the UAV for at most 5 s",
    ),
}
"""Limits of the grades that see the UAV in part.  Careless NPCs see nothing, hostile ones all."""
