"""A world of boxes on flat ground with an exact depth camera: enough to try a planner on."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from landing_systems.modules.planning_ego.parameters import EgoParameters
from landing_systems.modules.planning_ego.planner import EgoPlanner, Setpoint
from pytest_garl import Camera, Observation

Array = NDArray[np.float64]
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
Box = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Lowest and highest corner."""


def depth_image(
    camera: Camera, eye_m: ArrayLike, attitude: Array, boxes: Sequence[Box]
) -> NDArray[np.float32]:
    """Return the planar depth (H, W) of boxes on the ground z = 0; 100 where there is nothing."""
    eye = np.array(eye_m, float)
    rotation = Rotation.from_quat(attitude).as_matrix()
    rays = _rays(camera) @ rotation.T.astype(np.float32)
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(rays[..., 2] < 0, np.float32(-eye[2]) / rays[..., 2], np.float32(100))
        for low, high in boxes:
            part = _part_of_image(camera, (np.array([low, high]) - eye) @ rotation)
            to_low = (np.array(low) - eye).astype(np.float32) / rays[part]
            to_high = (np.array(high) - eye).astype(np.float32) / rays[part]
            enters = np.minimum(to_low, to_high).max(axis=-1)
            leaves = np.maximum(to_low, to_high).min(axis=-1)
            seen = (enters > 0) & (enters <= leaves) & (enters < depth[part])
            depth[part] = np.where(seen, enters, depth[part])
    return np.minimum(depth, np.float32(100))


def _rays(camera: Camera) -> NDArray[np.float32]:
    (cx, cy), f = camera.centre_px, camera.focal_px
    u, v = np.meshgrid(np.arange(camera.width_px), np.arange(camera.height_px))
    rays = np.stack([(cy - v) / f, (cx - u) / f, np.full(u.shape, -1.0)], axis=-1)
    return np.asarray(rays, np.float32)


def _part_of_image(camera: Camera, ends: Array) -> tuple[slice, slice]:
    """Return rows and columns that surely hold a level camera's box; all if it is tilted.

    ``ends`` (2, 3) are the lowest and highest corner in the body frame.
    """
    whole = slice(0, camera.height_px), slice(0, camera.width_px)
    if (ends[0] > ends[1]).any() or -ends[1, 2] < 0.1:
        return whole
    (cx, cy), f = camera.centre_px, camera.focal_px
    corners = np.array(list(itertools.product(*ends.T)))
    u, v = cx + f * corners[:, 1] / corners[:, 2], cy + f * corners[:, 0] / corners[:, 2]
    rows = slice(max(0, int(v.min()) - 1), max(0, int(v.max()) + 2))
    return rows, slice(max(0, int(u.min()) - 1), max(0, int(u.max()) + 2))


def observe(
    camera: Camera,
    time_s: float,
    position_m: ArrayLike,
    boxes: Sequence[Box],
    *,
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
    attitude: Array = LEVEL,
) -> Observation:
    """Return what a UAV would observe; its camera sits at ``offset_m`` in its body."""
    position = np.array(position_m, float)
    eye = position + Rotation.from_quat(attitude).apply(offset_m)
    return Observation(
        time_s=time_s,
        position_m=position,
        velocity_mps=np.zeros(3),
        attitude=attitude,
        image=np.zeros((0, 0, 3), np.uint8),
        depth_m=depth_image(camera, eye, attitude, boxes),
    )


def distance_to(boxes: Sequence[Box], points: Array) -> Array:
    """Distance (n,) of points (n, 3) from the nearest box."""
    outside = [np.maximum(np.maximum(low - points, points - high), 0) for low, high in boxes]
    return np.asarray(np.linalg.norm(outside, axis=2).min(axis=0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Run:
    """A run of the planner: times (n,), places (n, 3), and what it said."""

    time_s: Array
    position_m: Array
    setpoints: tuple[Setpoint, ...]


def fly(
    planner: EgoPlanner,
    parameters: EgoParameters,
    camera: Camera,
    start_m: tuple[float, float, float],
    goal_m: tuple[float, float, float],
    boxes: Callable[[float], Sequence[Box]],
    *,
    seconds: float = 30.0,
    from_s: float = 0.0,
) -> Run:
    """Fly a UAV that is at each setpoint one frame later, until the goal is reached.

    ``boxes`` gives the boxes at a time.  The parameters' ``lookahead_s`` must be the
    frame's 0.1 s, so that the UAV keeps up with its trajectory.
    """
    position, velocity = np.array(start_m, float), np.zeros(3)
    times, places, said = [], [], []
    for frame in range(round(seconds * camera.rate_hz)):
        time_s = from_s + frame / camera.rate_hz
        seen = observe(camera, time_s, position, boxes(time_s), offset_m=parameters.camera_offset_m)
        planner.observe(seen)
        planner.set_goal(goal_m)
        setpoint = planner.plan(time_s, position, velocity)
        times.append(time_s)
        places.append(position)
        said.append(setpoint)
        if setpoint.reached:
            break
        position, velocity = np.array(setpoint.position_m), np.array(setpoint.velocity_mps)
    return Run(time_s=np.array(times), position_m=np.array(places), setpoints=tuple(said))
