"""The conditions of a picture that the detectability study draws beside the weather and the sun."""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.scenarios.genes import SUN
from pytest_garl.scenarios.groups import DECOY_KINDS, DECOY_REACH_M, WEATHER
from pytest_garl.simulation.camera.exposure import Movement

ACTS = 0.25
"""Share of the scenarios in which each group of further conditions acts."""
LAST_S = 300.0
"""Longer than a flight: what happens for some seconds is drawn for all frames of a scenario."""
SPEED_MPS, SPIN_RADPS = 2.0, 0.5
"""Standard deviations of the UAV's movement, along and about each axis: a search flies at some 2
m/s, and a multirotor that corrects its attitude turns by some 0.5 rad/s."""
RANGES = {
    "pad.worn_percent": (0.0, 20.0),
    "cover.share_percent": (0.0, 100.0),
    "camera.exposure_ms": (0.0, 100.0),
    "camera.dirt_percent": (0.0, 80.0),
}
"""The full ranges that a file may name.  An error of mounting is a tilt, and an error of the focal
length another height; both are drawn."""
CONDITIONS = (*WEATHER, SUN, *RANGES)
"""What a frame's row holds of its scenario."""


def random_conditions(rng: np.random.Generator) -> dict[str, float]:
    """Draw the turns of pad and sun, and each further condition or none."""
    found = {"pad.yaw_deg": float(rng.uniform(-180, 180)), "light.turn_deg": 0.0}
    if rng.random() < 0.5:
        found["light.turn_deg"] = float(rng.uniform(-180, 180))
    for key in ("pad.worn_percent", "camera.exposure_ms", "camera.dirt_percent"):
        found |= _drawn(rng, key)
    found |= _drawn(rng, "cover.share_percent")
    if "cover.share_percent" in found:
        found["cover.lasts_s"] = LAST_S
    if rng.random() < ACTS:
        found["decoy-1.kind"] = float(rng.integers(1, len(DECOY_KINDS)))
        found["decoy-1.yaw_deg"] = float(rng.uniform(-180, 180))
        for axis in ("x", "y"):
            found[f"decoy-1.{axis}_m"] = float(rng.uniform(-DECOY_REACH_M, DECOY_REACH_M))
    return found


def random_movement(rng: np.random.Generator) -> Movement:
    """Draw how the UAV moves while a picture is exposed."""
    vx, vy, vz = (float(each) for each in rng.normal(0, SPEED_MPS, 3))
    spin = rng.normal(0, SPIN_RADPS, 3)
    x, y, z = (float(each) for each in np.clip(spin, -math.pi, math.pi))
    return Movement(velocity_mps=(vx, vy, vz), spin_radps=(x, y, z))


def _drawn(rng: np.random.Generator, key: str) -> dict[str, float]:
    low, high = RANGES[key]
    return {key: float(rng.uniform(low, high))} if rng.random() < ACTS else {}
