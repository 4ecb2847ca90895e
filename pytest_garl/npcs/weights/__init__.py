"""The learned NPC policies: weights (.npz) with their manifests, named after the policy."""

from __future__ import annotations

from pathlib import Path

WEIGHTS = Path(__file__).parent
