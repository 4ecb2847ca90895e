"""The downward camera: a compositor that gives colour, depth and segmentation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.maps import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placement import MARKER_SIDE_M, marker_position_m
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.ground import Raster, paint_ground, shadow_of
from pytest_garl.simulation.meshes import (
    Mesh,
    clip_near,
    clip_polygon,
    mesh_of,
    placed,
    placed_hulls,
    rotation_matrix,
)
from pytest_garl.simulation.particles import Particles
from pytest_garl.simulation.sensor import Sensor
from pytest_garl.simulation.weather import conditions_of

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Array = NDArray[np.float32]
NEAR_M = 0.05
FAR_M = 100.0
_SHIFT = 4
_SPECULAR_RADIUS = 0.10
"""Half-width, as a tangent, of the sun's smeared reflection on a wet rough ground:
engineering estimate."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """One picture: RGB uint8 (H, W, 3), planar depth float32 (H, W), segmentation int32 (H, W).

    A ray that meets nothing has depth 100 and segment -1.
    """

    image: NDArray[np.uint8]
    depth_m: NDArray[np.float32]
    segmentation: NDArray[np.int32]


class Renderer:
    """Draws what the camera sees in one scenario; a frame is a pure function of its arguments.

    ``segment_ids`` numbers ground (0), marker (1), static bodies and dynamic objects.
    """

    def __init__(
        self, scenario: Scenario, map: Map, camera: Camera, rng: np.random.Generator
    ) -> None:
        self.camera = camera
        self.conditions = conditions_of(scenario)
        self.marker_m = marker_position_m(scenario, map)
        names = ["ground", "marker", *(body.name for body in map.bodies)]
        names += [name for name, _ in map.object_names]
        self.segment_ids: Mapping[str, int] = {name: index for index, name in enumerate(names)}
        self._ground = paint_ground(scenario, map, self.conditions, rng)
        self._static = []
        for body in map.bodies:
            mesh = mesh_of(body.parts)
            corners, normals = placed(mesh, body.position_m, body.yaw_rad)
            colours = self._shade(mesh.colours, normals)
            self._static.append((body, mesh, corners, normals, colours))
        self._objects = [
            (name, mesh_of(OBJECT_TYPES[kind].parts)) for name, kind in map.object_names
        ]
        self._outlines: dict[str, tuple[float, list[NDArray[np.float64]]]] = {}
        width, height = camera.width_px, camera.height_px
        (cx, cy), focal = camera.centre_px, camera.focal_px
        u, v = np.meshgrid(np.arange(width), np.arange(height))
        self._inverse = np.linalg.inv(camera.matrix)
        self._stretch = np.sqrt(1 + ((u - cx) / focal) ** 2 + ((v - cy) / focal) ** 2).astype(
            np.float32
        )
        self._homogeneous = np.stack([u, v, np.ones_like(u)]).reshape(3, -1).astype(np.float32)
        self._fov_y = 2 * math.atan(height / 2 / focal)
        self._settings = cv2.TriangleRasterizeSettings()
        self._settings.setShadingType(cv2.RASTERIZE_SHADING_FLAT)
        self._settings.setCullingMode(cv2.RASTERIZE_CULLING_NONE)
        self._to_gl = np.diag([1.0, -1.0, -1.0, 1.0]).astype(np.float32)
        self._sensor = Sensor(camera, self.conditions, rng)
        self._particles = Particles(camera, self.conditions, rng)
        airlight = np.array(self.conditions.airlight)
        self._air = np.empty((height, width, 3), np.uint8)
        self._air[:] = airlight.astype(np.uint8)

    def render(
        self,
        position_m: Vector,
        attitude: Quaternion,
        time_s: float,
        objects: Sequence[tuple[Vector, float]],
        *,
        colour: bool = True,
    ) -> Frame:
        """Return the frame from a camera at ``position_m`` with the UAV's ``attitude``.

        ``objects`` are the (position, yaw) of the dynamic objects in the map's order;
        ``colour=False`` leaves the image black and is faster.
        """
        eye = np.array(position_m)
        axes = _camera_axes(attitude)
        depth, denominator = self._ground_depth(eye, axes)
        segmentation = np.where(depth < FAR_M, 0, -1).astype(np.int32)
        self._marker_segment(segmentation, eye, axes)
        height, width = depth.shape
        image = np.zeros((height, width, 3), np.uint8)
        if colour:
            self._ground_image(image, eye, axes, depth)
            self._shadows(image, eye, axes, objects)
            self._gloss(image, axes)
            if denominator:
                image[segmentation < 0] = self._air[0, 0]
        self._solids(image, depth, segmentation, eye, axes, objects)
        if colour:
            self._weather(image, depth, axes, eye, time_s)
            image = self._sensor.expose(image, time_s)
        return Frame(image=image, depth_m=depth, segmentation=segmentation)

    def marker_area_px(self, position_m: Vector, attitude: Quaternion) -> float:
        """Projected area of the marker, clipped to the frame, with nothing in front."""
        polygon = self._marker_polygon(np.array(position_m), _camera_axes(attitude))
        if len(polygon) < 3:
            return 0.0
        width, height = self.camera.width_px, self.camera.height_px
        frame = np.array(
            [[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]],
            np.float32,
        )
        area, _ = cv2.intersectConvexConvex(polygon, frame)
        return float(area)

    def marker_side_px(self, height_m: float) -> float:
        """Side in pixels of the marker seen from straight above."""
        return self.camera.focal_px * MARKER_SIDE_M / height_m

    def _ground_depth(
        self, eye: NDArray[np.float64], axes: NDArray[np.float64]
    ) -> tuple[Array, bool]:
        row = (axes.T @ self._inverse)[2].astype(np.float32)
        slope = (row @ self._homogeneous).reshape(self._stretch.shape)
        horizon = bool((slope > -1e-3).any())
        depth = np.float32(-eye[2]) / np.minimum(slope, np.float32(-1e-3))
        if horizon:
            depth[slope > -1e-3] = FAR_M
        np.minimum(depth, np.float32(FAR_M), out=depth)
        exact: Array = depth.astype(np.float32)
        return exact, horizon

    def _world_of_pixel(
        self, eye: NDArray[np.float64], axes: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Matrix (3, 3) from homogeneous pixels to homogeneous world (x, y) on the ground."""
        rays = axes.T @ self._inverse
        return np.stack(
            [eye[0] * rays[2] - eye[2] * rays[0], eye[1] * rays[2] - eye[2] * rays[1], rays[2]]
        )

    def _ground_image(
        self,
        image: NDArray[np.uint8],
        eye: NDArray[np.float64],
        axes: NDArray[np.float64],
        depth: Array,
    ) -> None:
        world = self._world_of_pixel(eye, axes)
        footprint = float(np.median(depth[::16, ::16])) / self.camera.focal_px
        for raster, border in (
            (self._ground.wide, cv2.BORDER_REFLECT_101),
            (self._ground.inset, cv2.BORDER_TRANSPARENT),
        ):
            level = _level(raster, footprint)
            cv2.warpPerspective(
                raster.levels[level],
                raster.pixel_of_world(level) @ world,
                (image.shape[1], image.shape[0]),
                image,
                flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
                borderMode=border,
            )

    def _marker_polygon(self, eye: NDArray[np.float64], axes: NDArray[np.float64]) -> Array:
        half = MARKER_SIDE_M / 2
        x, y = self.marker_m
        corners = np.array(
            [[x - half, y + half], [x + half, y + half], [x + half, y - half], [x - half, y - half]]
        )
        return self._project_ground(corners, eye, axes)

    def _project_ground(
        self, points: NDArray[np.float64], eye: NDArray[np.float64], axes: NDArray[np.float64]
    ) -> Array:
        """Project a polygon on the ground (n, 2) to pixels (m, 2), clipped at the near plane."""
        world = np.column_stack([points, np.zeros(len(points))])
        seen = clip_polygon(((world - eye) @ axes.T).astype(np.float32), NEAR_M)
        if len(seen) == 0:
            return np.zeros((0, 2), np.float32)
        (cx, cy), focal = self.camera.centre_px, self.camera.focal_px
        pixels = focal * seen[:, :2] / seen[:, 2:] + np.array([cx, cy])
        bounded: Array = np.clip(pixels, -2e4, 2e4).astype(np.float32)
        return bounded

    def _marker_segment(
        self, segmentation: NDArray[np.int32], eye: NDArray[np.float64], axes: NDArray[np.float64]
    ) -> None:
        polygon = self._marker_polygon(eye, axes)
        if len(polygon) >= 3:
            points = np.round(polygon * 2**_SHIFT).astype(np.int32)
            cv2.fillConvexPoly(segmentation, points, (1.0,), cv2.LINE_8, _SHIFT)

    def _shadows(
        self,
        image: NDArray[np.uint8],
        eye: NDArray[np.float64],
        axes: NDArray[np.float64],
        objects: Sequence[tuple[Vector, float]],
    ) -> None:
        sun, share = self.conditions.sun, self.conditions.direct_share
        if share <= 0.01 or sun[2] <= 0.02:
            return
        outlines = []
        for (name, mesh), (at, yaw) in zip(self._objects, objects, strict=True):
            middle = np.array(at[:2]) - np.array(sun[:2]) / sun[2] * at[2]
            if np.hypot(*(middle - eye[:2])) > 3 * max(2.0, eye[2]) + mesh.radius_m:
                continue
            for outline in self._shadow_outlines(name, mesh, yaw):
                pixels = self._project_ground(outline + middle, eye, axes)
                if len(pixels) >= 3:
                    outlines.append(np.round(pixels * 2**_SHIFT).astype(np.int32))
        if outlines:
            mask = np.zeros(image.shape[:2], np.uint8)
            for outline in outlines:
                cv2.fillConvexPoly(mask, outline, (255.0,), cv2.LINE_8, _SHIFT)
            if mask.any():
                cv2.copyTo(cv2.convertScaleAbs(image, alpha=1 - share), mask, image)

    def _shadow_outlines(self, name: str, mesh: Mesh, yaw_rad: float) -> list[NDArray[np.float64]]:
        """Return the parts' shadows about the object's own; kept until it turns."""
        kept = self._outlines.get(name)
        if kept is None or kept[0] != yaw_rad:
            hulls = placed_hulls(mesh, (0.0, 0.0, 0.0), yaw_rad)
            shadows = (shadow_of(hull, self.conditions.sun) for hull in hulls)
            outlines = [cv2.convexHull(s).reshape(-1, 2).astype(np.float64) for s in shadows]
            self._outlines[name] = kept = (yaw_rad, outlines)
        return kept[1]

    def _gloss(self, image: NDArray[np.uint8], axes: NDArray[np.float64]) -> None:
        """Add the sun's reflection on wet ground, where the mirrored ray meets the sun."""
        strength = 230.0 * self.conditions.wetness * self.conditions.direct_share
        sun = np.array(self.conditions.sun)
        mirrored = axes @ np.array([sun[0], sun[1], -sun[2]])
        if strength < 1 or mirrored[2] < 0.3:
            return
        (cx, cy), focal = self.camera.centre_px, self.camera.focal_px
        u, v = focal * mirrored[:2] / mirrored[2] + np.array([cx, cy])
        sigma = _SPECULAR_RADIUS * focal / mirrored[2]
        across = np.exp(-(((np.arange(image.shape[1]) - u) / sigma) ** 2) / 2)
        down = np.exp(-(((np.arange(image.shape[0]) - v) / sigma) ** 2) / 2)
        glow = (strength * np.outer(down, across)).astype(np.uint8)
        if glow.any():
            cv2.add(image, cv2.merge([glow, glow, glow]), image)

    def _shade(self, colours: Array, normals: Array) -> Array:
        share = self.conditions.direct_share
        facing = np.clip(normals @ np.array(self.conditions.sun, np.float32), 0, 1)
        sky = 0.75 + 0.25 * normals[:, 2]
        light = (1 - share) * sky + share * facing / max(0.35, self.conditions.sun[2])
        lit: Array = (colours * np.clip(light, 0, 1.15)[:, None]).astype(np.float32)
        return lit

    def _solids(
        self,
        image: NDArray[np.uint8],
        depth: Array,
        segmentation: NDArray[np.int32],
        eye: NDArray[np.float64],
        axes: NDArray[np.float64],
        objects: Sequence[tuple[Vector, float]],
    ) -> None:
        batches = []
        for body, mesh, corners, normals, colours in self._static:
            if self._in_view(np.array(body.position_m), mesh.radius_m, eye, axes):
                batches.append((corners, normals, colours, self.segment_ids[body.name]))
        for (name, mesh), (at, yaw) in zip(self._objects, objects, strict=True):
            if self._in_view(np.array(at), mesh.radius_m, eye, axes):
                corners, normals = placed(mesh, at, yaw)
                colours = self._shade(mesh.colours, normals)
                batches.append((corners, normals, colours, self.segment_ids[name]))
        if not batches:
            return
        corners = np.concatenate([batch[0] for batch in batches])
        normals = np.concatenate([batch[1] for batch in batches])
        colours = np.concatenate([batch[2] for batch in batches])
        segments = np.repeat([batch[3] for batch in batches], [len(batch[0]) for batch in batches])
        relative = corners - eye.astype(np.float32)
        facing = np.flatnonzero(np.einsum("ij,ij->i", relative[:, 0], normals) < 0)
        triangles, origin = clip_near(relative[facing] @ axes.T.astype(np.float32), NEAR_M)
        if len(triangles) == 0:
            return
        origin = facing[origin]
        count = len(triangles)
        codes = np.zeros((3 * count, 3), np.float32)
        codes[:, 0] = np.repeat(np.arange(1, count + 1, dtype=np.float32), 3)
        drawn = np.zeros((*depth.shape, 3), np.float32)
        cv2.triangleRasterize(
            np.ascontiguousarray(triangles.reshape(-1, 3)),
            np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
            codes,
            drawn,
            depth,
            self._to_gl,
            self._fov_y,
            NEAR_M,
            FAR_M,
            self._settings,
        )
        code = np.asarray(cv2.extractChannel(drawn, 0)).ravel()
        covered = np.flatnonzero(code)
        face = origin[code[covered].astype(np.int64) - 1]
        segmentation.ravel()[covered] = segments[face]
        painted = np.clip(colours, 0, 255).astype(np.uint8)
        image.reshape(-1, 3)[covered] = painted[face]

    def _in_view(
        self,
        centre: NDArray[np.float64],
        radius_m: float,
        eye: NDArray[np.float64],
        axes: NDArray[np.float64],
    ) -> bool:
        x, y, z = axes @ (centre - eye)
        if z < -radius_m or z > FAR_M:
            return False
        reach_x = self.camera.width_px / 2 / self.camera.focal_px
        reach_y = self.camera.height_px / 2 / self.camera.focal_px
        slack_x, slack_y = math.hypot(1, reach_x), math.hypot(1, reach_y)
        return bool(
            abs(x) - reach_x * z < radius_m * slack_x and abs(y) - reach_y * z < radius_m * slack_y
        )

    def _weather(
        self,
        image: NDArray[np.uint8],
        depth: Array,
        axes: NDArray[np.float64],
        eye: NDArray[np.float64],
        time_s: float,
    ) -> None:
        self._particles.draw(image, depth, axes, eye, time_s)
        if self.conditions.extinction_per_m > 0:
            length = cv2.multiply(depth, self._stretch)
            through = np.asarray(cv2.exp(length * np.float32(-self.conditions.extinction_per_m)))
            cv2.blendLinear(image, self._air, through, np.float32(1.0) - through, image)


def _camera_axes(attitude: Quaternion) -> NDArray[np.float64]:
    """Rows right, down and forward of the camera in the world, shape (3, 3)."""
    body = rotation_matrix(attitude)
    return np.stack([-body[:, 1], -body[:, 0], -body[:, 2]])


def _level(raster: Raster, footprint_m: float) -> int:
    wanted = math.log2(max(footprint_m / raster.m_per_px, 1e-6))
    return min(len(raster.levels) - 1, max(0, round(wanted)))
