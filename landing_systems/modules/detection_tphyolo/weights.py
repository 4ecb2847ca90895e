"""Weights on disk: two ONNX files and their manifest, checked before anything is loaded."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from landing_systems.modules.detection_tphyolo.decoding import CLASS_IDS, NETWORK_SIZE
from landing_systems.modules.detection_tphyolo.patches import PATCH_PX

SHIPPED = Path(__file__).with_name("weights") / "tphyolo.json"
FORMAT = 1
NETWORKS = ("boxes", "ids")


class WeightsError(Exception):
    """Weights that cannot be used; the message names the file and what to do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """Checked files of both networks, and the confidence's slope and offset on logits."""

    boxes: Path
    ids: Path
    calibration: tuple[float, float]


def write_weights(
    manifest: Path,
    networks: Mapping[str, bytes],
    calibration: tuple[float, float],
    about: Mapping[str, Any],
) -> None:
    """Write the manifest (.json) and beside it the networks (-boxes.onnx, -ids.onnx)."""
    manifest.parent.mkdir(parents=True, exist_ok=True)
    for name in NETWORKS:
        network_file(manifest, name).write_bytes(networks[name])
    content = {
        "format": FORMAT,
        "sha256": {name: hashlib.sha256(networks[name]).hexdigest() for name in NETWORKS},
        "classes": list(CLASS_IDS),
        "network_size": list(NETWORK_SIZE),
        "patch_size": PATCH_PX,
        "calibration": {"slope": calibration[0], "offset": calibration[1]},
        **about,
    }
    manifest.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def network_file(manifest: Path, name: str) -> Path:
    """Return where a network of a manifest lies."""
    return manifest.with_name(f"{manifest.stem}-{name}.onnx")


def read_weights(file: Path) -> Weights:
    """Return what the manifest tells; raise WeightsError where it or a network is damaged."""
    try:
        manifest = json.loads(file.read_text(encoding="utf-8"))
        contents = {name: network_file(file, name).read_bytes() for name in NETWORKS}
    except (OSError, ValueError) as error:
        raise _wrong(file, f"cannot be read with its networks ({error})") from error
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise _wrong(file, f"is not a manifest of format {FORMAT}")
    hashes = manifest.get("sha256")
    for name, content in contents.items():
        found = hashlib.sha256(content).hexdigest()
        expected = str(hashes.get(name)) if isinstance(hashes, dict) else "nothing"
        if found != expected:
            raise _wrong(
                network_file(file, name),
                f"has the hash {found[:16]}…, its manifest says {expected[:16]}…",
            )
    sizes = {"classes": list(CLASS_IDS), "network_size": list(NETWORK_SIZE), "patch_size": PATCH_PX}
    for key, value in sizes.items():
        if manifest.get(key) != value:
            raise _wrong(file, f"has {key} = {manifest.get(key)}; expected {value}")
    try:
        numbers = manifest["calibration"]
        slope, offset = float(numbers["slope"]), float(numbers["offset"])
    except (KeyError, TypeError, ValueError) as error:
        raise _wrong(file, f"has no calibration with slope and offset ({error})") from error
    if not (math.isfinite(slope) and math.isfinite(offset) and slope > 0):
        raise _wrong(file, f"has the slope {slope} and offset {offset}; expected finite, rising")
    return Weights(
        boxes=network_file(file, "boxes"),
        ids=network_file(file, "ids"),
        calibration=(slope, offset),
    )


def _wrong(path: Path, problem: str) -> WeightsError:
    return WeightsError(
        f"marker detector: {path} {problem}; restore the files, or train it again with "
        "`python -m lab.train_detector.train`"
    )
