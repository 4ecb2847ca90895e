"""Weights on disk: an ONNX file and its manifest, checked before anything is loaded."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from landing_systems.modules.detection_tphyolo.decoding import CLASS_IDS, NETWORK_SIZE

SHIPPED = Path(__file__).with_name("weights") / "tphyolo.onnx"
FORMAT = 1


class WeightsError(Exception):
    """Weights that cannot be used; the message names the file and what to do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """What a manifest says that flying needs: the confidence's slope and offset on logits."""

    calibration: tuple[float, float]


def write_weights(
    path: Path, content: bytes, calibration: tuple[float, float], about: Mapping[str, Any]
) -> None:
    """Write weights (.onnx) and their manifest (.json) beside them."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    manifest = {
        "format": FORMAT,
        "sha256": hashlib.sha256(content).hexdigest(),
        "classes": list(CLASS_IDS),
        "network_size": list(NETWORK_SIZE),
        "calibration": {"slope": calibration[0], "offset": calibration[1]},
        **about,
    }
    text = json.dumps(manifest, indent=2) + "\n"
    path.with_suffix(".json").write_text(text, encoding="utf-8")


def read_weights(path: Path) -> tuple[bytes, Manifest]:
    """Return the weights' bytes and their manifest; raise WeightsError where they disagree."""
    file = path.with_suffix(".json")
    try:
        content = path.read_bytes()
        manifest = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise _wrong(path, f"cannot be read with its manifest {file.name} ({error})") from error
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise _wrong(file, f"is not a manifest of format {FORMAT}")
    found, told = hashlib.sha256(content).hexdigest(), str(manifest.get("sha256"))
    if found != told:
        raise _wrong(path, f"has the hash {found[:16]}…, its manifest says {told[:16]}…")
    expected = (list(CLASS_IDS), list(NETWORK_SIZE))
    if (manifest.get("classes"), manifest.get("network_size")) != expected:
        raise _wrong(file, f"is for other classes or sizes; expected {expected}")
    try:
        numbers = manifest["calibration"]
        slope, offset = float(numbers["slope"]), float(numbers["offset"])
    except (KeyError, TypeError, ValueError) as error:
        raise _wrong(file, f"has no calibration with slope and offset ({error})") from error
    if not (math.isfinite(slope) and math.isfinite(offset) and slope > 0):
        raise _wrong(file, f"has the slope {slope} and offset {offset}; expected finite, rising")
    return content, Manifest(calibration=(slope, offset))


def _wrong(path: Path, problem: str) -> WeightsError:
    return WeightsError(
        f"marker detector: {path} {problem}; restore the file, or train it again with "
        "`python -m landing_systems.modules.detection_tphyolo.train`"
    )
