"""Parts as triangles, and triangles clipped before the rasteriser sees them."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_garl.scenarios.bodies import Part

Array = NDArray[np.float32]
_FINE, _COARSE = (10, 5), (6, 3)
"""Sides and rings of round parts."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mesh:
    """Triangles of a body: ``corners`` (n, 3, 3), ``normals`` (n, 3), ``colours`` (n, 3).

    A triangle faces a point p if ``normals @ p > offsets``.
    """

    corners: Array
    normals: Array
    offsets: Array
    colours: Array
    radius_m: float
    hulls: tuple[Array, ...]
    """Each part's vertices, for its shadow."""


@functools.cache
def mesh_of(parts: tuple[Part, ...], *, coarse_below_m: float = 0.0) -> Mesh:
    """Return the triangles of convex parts, wound outwards, in the body's frame.

    Round parts with a radius of at most ``coarse_below_m`` get fewer triangles.
    """
    corners, normals, colours, hulls = [], [], [], []
    for part in parts:
        coarse = max(part.size_m[:2]) / 2 <= coarse_below_m
        vertices, faces = _primitive(part, *(_COARSE if coarse else _FINE))
        turned = vertices @ rotation_matrix(part.rotation).T + np.array(part.position_m)
        triangles = turned[faces]
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        outward = ((triangles.mean(axis=1) - np.array(part.position_m)) * normal).sum(axis=1) > 0
        normal[~outward] *= -1
        triangles[~outward] = triangles[~outward][:, ::-1]
        corners.append(triangles)
        normals.append(normal / np.linalg.norm(normal, axis=1, keepdims=True))
        colours.append(np.tile(np.array(part.colour, dtype=np.float64), (len(faces), 1)))
        hulls.append(turned.astype(np.float32))
    every = np.concatenate(corners)
    outwards = np.concatenate(normals)
    return Mesh(
        corners=every.astype(np.float32),
        normals=outwards.astype(np.float32),
        offsets=(every[:, 0] * outwards).sum(axis=1).astype(np.float32),
        colours=np.concatenate(colours).astype(np.float32),
        radius_m=float(np.linalg.norm(every.reshape(-1, 3), axis=1).max()),
        hulls=tuple(hulls),
    )


def placed(
    mesh: Mesh, position_m: tuple[float, float, float], yaw_rad: float
) -> tuple[Array, Array]:
    """Return corners and normals of a mesh at a place in the world."""
    turn = yaw_matrix(yaw_rad)
    corners = mesh.corners @ turn.T + np.array(position_m, dtype=np.float32)
    return corners, mesh.normals @ turn.T


def placed_hulls(mesh: Mesh, position_m: tuple[float, float, float], yaw_rad: float) -> list[Array]:
    """Return the parts' vertices of a mesh at a place in the world."""
    turn, at = yaw_matrix(yaw_rad).T, np.array(position_m, dtype=np.float32)
    return [hull @ turn + at for hull in mesh.hulls]


def clip_near(triangles: Array, near_m: float) -> tuple[Array, NDArray[np.intp]]:
    """Clip camera-frame triangles (n, 3, 3) at forward depth ``near_m`` (third coordinate).

    Returns the triangles that remain and the index of the one that each came from.
    """
    inside = triangles[:, :, 2] > near_m
    count = inside.sum(axis=1)
    whole = np.flatnonzero(count == 3)
    cut = np.flatnonzero((count == 1) | (count == 2))
    if len(cut) == 0:
        return triangles[whole], whole
    starts = triangles[cut]
    ends = np.roll(starts, -1, axis=1)
    rise = ends[:, :, 2:] - starts[:, :, 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossings = starts + (near_m - starts[:, :, 2:]) / rise * (ends - starts)
    points = np.concatenate([starts, crossings], axis=1)
    picks = _CLIPPED[inside[cut] @ np.array([1, 2, 4])]
    there = picks[:, :, 0] >= 0
    extra = points[np.arange(len(cut))[:, None, None], picks][there]
    return (
        np.concatenate([triangles[whole], extra]),
        np.concatenate([whole, np.repeat(cut, there.sum(axis=1))]),
    )


_NONE = (-1, -1, -1)
_CLIPPED = np.array(
    [
        (_NONE, _NONE),
        ((0, 3, 5), _NONE),
        ((3, 1, 4), _NONE),
        ((0, 1, 4), (0, 4, 5)),
        ((4, 2, 5), _NONE),
        ((0, 3, 4), (0, 4, 2)),
        ((3, 1, 2), (3, 2, 5)),
        (_NONE, _NONE),
    ]
)
"""What is left of a triangle, by the sum of 1, 2, 4 for the corners that stay: one or two
triangles of its corners 0, 1, 2 and of the places 3, 4, 5 where its sides, from corner 0 on, are
cut."""


def clip_polygon(points: Array, near_m: float) -> Array:
    """Clip a camera-frame polygon (n, 3) at forward depth ``near_m``; may be empty."""
    if (points[:, 2] > near_m).all():
        return points
    return _clip_polygon(points, near_m)


def _clip_polygon(points: Array, near_m: float) -> Array:
    kept = []
    for start, end in zip(points, np.roll(points, -1, axis=0), strict=True):
        if start[2] > near_m:
            kept.append(start)
        if (start[2] > near_m) != (end[2] > near_m):
            share = (near_m - start[2]) / (end[2] - start[2])
            kept.append(start + share * (end - start))
    return np.array(kept, dtype=np.float32).reshape(-1, 3)


def _primitive(part: Part, sides: int, rings: int) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    half = np.array(part.size_m) / 2
    if part.shape == "box":
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
        quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
        faces = [(a, b, c) for a, b, c, _ in quads] + [(a, c, d) for a, _, c, d in quads]
        return signs * half, np.array(faces)
    angles = 2 * np.pi * np.arange(sides) / sides
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    if part.shape == "cylinder":
        rims = [np.column_stack([circle, np.full(sides, z)]) for z in (-1.0, 1.0)]
        vertices = np.concatenate([*rims, [[0, 0, -1.0], [0, 0, 1.0]]]) * half
        faces = []
        for a in range(sides):
            b = (a + 1) % sides
            faces += [(a, b, a + sides), (b, b + sides, a + sides)]
            faces += [(a, b, 2 * sides), (a + sides, b + sides, 2 * sides + 1)]
        return vertices, np.array(faces)
    polar = math.pi * np.arange(1, rings) / rings
    circles = [np.column_stack([circle * math.sin(p), np.full(sides, math.cos(p))]) for p in polar]
    vertices = np.concatenate([*circles, [[0, 0, 1.0], [0, 0, -1.0]]]) * half
    top, bottom = len(vertices) - 2, len(vertices) - 1
    faces = []
    for a in range(sides):
        b = (a + 1) % sides
        faces += [(top, a, b), (bottom, a + (rings - 2) * sides, b + (rings - 2) * sides)]
        for ring in range(rings - 2):
            i, j = ring * sides, (ring + 1) * sides
            faces += [(a + i, b + i, a + j), (b + i, b + j, a + j)]
    return vertices, np.array(faces)


def rotation_matrix(q: tuple[float, float, float, float]) -> NDArray[np.float64]:
    """Matrix (3, 3) of a quaternion x, y, z, w."""
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def yaw_matrix(yaw_rad: float) -> Array:
    """Matrix (3, 3) of a turn about z."""
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]], dtype=np.float32)
