from __future__ import annotations

from pytest_garl.npcs.learned import read_manifest
from pytest_garl.npcs.policy_catalogue import learned_policies
from pytest_garl.npcs.training.presets import PRESETS
from pytest_garl.npcs.weights import WEIGHTS


def test_each_shipped_learned_policy_has_the_preset_of_its_training() -> None:
    whole = {name for name, preset in PRESETS.items() if not preset.surrogate.grades}
    assert whole == {*learned_policies()}
    for name, preset in PRESETS.items():
        folder = WEIGHTS / "grades" if preset.surrogate.grades else WEIGHTS
        manifest = read_manifest(folder / f"{name}.npz")
        assert manifest["state"] == preset.surrogate.state
        assert manifest["surrogate"]["uav"] == preset.surrogate.uav
        if name == "director":
            # It learns from tables, by no reward on the way.
            assert manifest["surrogate"]["takes_off"] == preset.surrogate.takes_off
            assert manifest["training"]["episodes"] == preset.training.episodes
            continue
        assert manifest["surrogate"]["reward"] == preset.surrogate.reward
        assert manifest["training"]["steps"] == preset.training.steps
