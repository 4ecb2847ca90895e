from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from landing_systems.modules.detection_tphyolo.weights import (
    SHIPPED,
    WeightsError,
    network_file,
    read_weights,
    write_weights,
)


def changed(path: Path, **values: Any) -> None:
    path.write_text(json.dumps({**json.loads(path.read_text()), **values}))


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    path = tmp_path / "w.json"
    write_weights(path, {"boxes": b"network", "ids": b"another"}, (1.5, -0.5), {"seed": 3})
    return path


def test_written_weights_are_read_back(weights: Path) -> None:
    read = read_weights(weights)
    assert (read.boxes.read_bytes(), read.ids.read_bytes()) == (b"network", b"another")
    assert read.calibration == (1.5, -0.5)


@pytest.mark.parametrize("name", ["boxes", "ids"])
def test_damaged_weights_are_refused(weights: Path, name: str) -> None:
    network_file(weights, name).write_bytes(b"netw0rk")
    with pytest.raises(WeightsError, match=rf"w-{name}\.onnx has the hash .* its manifest says"):
        read_weights(weights)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"format": 2}, "not a manifest of format 1"),
        ({"classes": [0, 1]}, "has classes ="),
        ({"patch_size": 24}, "has patch_size = 24; expected 40"),
        ({"sha256": None}, "its manifest says nothing"),
        ({"calibration": {"slope": 1.0}}, "no calibration with slope and offset"),
        ({"calibration": {"slope": -1.0, "offset": 0.0}}, "expected finite, rising"),
        ({"calibration": {"slope": float("nan"), "offset": 0.0}}, "expected finite, rising"),
    ],
)
def test_a_wrong_manifest_is_refused(weights: Path, values: dict[str, Any], message: str) -> None:
    changed(weights, **values)
    with pytest.raises(WeightsError, match=message):
        read_weights(weights)


@pytest.mark.parametrize("content", ["", "[]", "{not json"])
def test_a_broken_manifest_is_refused(weights: Path, content: str) -> None:
    weights.write_text(content)
    with pytest.raises(WeightsError, match=r"w\.json"):
        read_weights(weights)


def test_missing_weights_are_named_with_the_command_that_makes_them(tmp_path: Path) -> None:
    with pytest.raises(
        WeightsError, match=r"gone\.json cannot be read.*lab\.train_detector\.train"
    ):
        read_weights(tmp_path / "gone.json")


def test_shipped_weights_are_small_and_whole() -> None:
    read = read_weights(SHIPPED)
    assert read.boxes.stat().st_size + read.ids.stat().st_size < 2_000_000
    manifest = json.loads(SHIPPED.read_text())
    assert manifest["parameters"] < 500_000
