"""Surrogates for the tests of training."""

from __future__ import annotations

from pytest_garl.npcs.training.presets import Surrogate
from pytest_garl.scenarios.maps.loading import load_map

COURT = (load_map("court"),)
OURS = Surrogate(maps=COURT)
PAPERS = Surrogate(maps=COURT, uav="straight", state="paper", reward="paper")
