from __future__ import annotations

from pytest_garl.adversary.catalogue import WEIGHTS, learned_policies
from pytest_garl.adversary.learned import read_manifest
from pytest_garl.adversary.training.presets import PRESETS


def test_each_shipped_learned_policy_has_the_preset_of_its_training() -> None:
    assert sorted(PRESETS) == sorted(learned_policies())
    for name, preset in PRESETS.items():
        manifest = read_manifest(WEIGHTS / f"{name}.npz")
        assert manifest["state"] == preset.surrogate.state
        assert manifest["surrogate"]["uav"] == preset.surrogate.uav
        assert manifest["surrogate"]["reward"] == preset.surrogate.reward
        assert manifest["training"]["steps"] == preset.training.steps
