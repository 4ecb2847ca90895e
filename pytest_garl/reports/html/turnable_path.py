"""The place of a flight for the turnable path: its ground from above, bodies, the marker."""

from __future__ import annotations

import base64
from typing import Any

import cv2
import numpy as np

from pytest_garl.reports.film.drawing import Image
from pytest_garl.reports.film.map_pane import ground_from_above
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.simulation.camera.meshes import mesh_of, placed_hulls
from pytest_garl.simulation.camera.renderer import Renderer

LONGER_SIDE_PX = 560
"""Enough for a path view of half a screen; the picture takes some 30 kB."""
BORDER_M = 2.0
GROUND_QUALITY = 70


def scene_data(place: Map, renderer: Renderer) -> dict[str, Any]:
    """Return the scene of a flight in the built-in simulator, for JSON.

    ``place`` is the map as it is flown, ``renderer`` that of the flight.

    ``ground`` is a picture whose pixel (0, 0) lies at ``x_m`` and ``y_m``, north up.  A body's part
    is an upright prism: its outline, its lowest and highest point, its colour.
    """
    x_min, x_max, y_min, y_max = place.bounds_m
    left, right, low, high = x_min - BORDER_M, x_max + BORDER_M, y_min - BORDER_M, y_max + BORDER_M
    px_per_m = LONGER_SIDE_PX / max(right - left, high - low)
    size = round((right - left) * px_per_m), round((high - low) * px_per_m)
    origin = -left * px_per_m, high * px_per_m
    assert renderer.ground is not None
    picture = ground_from_above(renderer.ground.wide, origin, px_per_m, size)
    return {
        "ground": jpeg_uri(picture, GROUND_QUALITY),
        "x_m": round(left, 2),
        "y_m": round(high, 2),
        "m_per_px": round(1 / px_per_m, 5),
        "bounds": [round(each, 2) for each in place.bounds_m],
        "outline": [[round(x, 2), round(y, 2)] for x, y in renderer.pad.main.outline_m],
        "bodies": [{"name": body.name, "parts": _parts(body)} for body in place.bodies],
    }


def _parts(body: Any) -> list[dict[str, Any]]:
    parts = []
    hulls = placed_hulls(mesh_of(body.parts), body.position_m, body.yaw_rad)
    for hull, part in zip(hulls, body.parts, strict=True):
        outline = cv2.convexHull(hull[:, :2].astype(np.float32)).reshape(-1, 2)
        # Twelve corners are round enough at this size.
        outline = outline[:: max(1, len(outline) // 12)]
        parts.append(
            {
                "outline": [[round(float(x), 2), round(float(y), 2)] for x, y in outline],
                "low": round(float(hull[:, 2].min()), 2),
                "high": round(float(hull[:, 2].max()), 2),
                "colour": list(part.colour),
            }
        )
    return parts


def jpeg_uri(picture: Image, quality: int) -> str:
    """Return an RGB picture as the address of a JPEG that a page holds itself."""
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    _, content = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return f"data:image/jpeg;base64,{base64.b64encode(content.tobytes()).decode()}"
