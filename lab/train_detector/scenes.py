"""Pictures of markers with the truth about them, drawn by the simulator's own renderer."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pytest_garl import Camera
from pytest_garl.fiducial import MARKER_SIDE_M, MarkerSpec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import CONFINED_WEATHER, genome_for
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placed import TARGET_MARKER_ID, Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.task import Task
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.camera.canvas import marker_bits
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.camera.projection import View
from pytest_garl.simulation.camera.renderer import Renderer

Weather = Literal["confined", "full"]
Pose = tuple[tuple[float, float, float], tuple[float, float, float, float]]
CAMERA = Camera()
HEIGHTS_M = (0.5, 15.0)
MAX_TILT_RAD = math.radians(20.0)
USUAL_TILT_RAD = math.radians(6.0)
EXTREME_SHARE = 0.25
"""In full weather each gene is drawn from its whole range with this probability, else from the
confined one: with all at once nothing could be seen in nearly all pictures."""
_CELLS = 7
_PROBES = 3 * _CELLS
"""Places per side of a marker, three per cell, at which its visibility is sampled."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Marker:
    """The true position and visibility of a marker in a picture.

    ``centre_px`` is the projection of its centre, ``size_px`` the width and height of the
    outline, both in pixel edges and also beyond the frame; ``side_px`` is its side seen from
    straight above.  ``framed`` is the share of its area inside the frame, ``hidden`` the share
    of that which is behind things or under leaves and snow (falling particles do not count),
    ``contrast`` the difference in grey levels between its white and its black where it is seen.
    """

    marker_id: int
    place_m: tuple[float, float]
    centre_px: tuple[float, float]
    size_px: tuple[float, float]
    side_px: float
    framed: float
    hidden: float
    contrast: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Picture:
    """A rendered frame, where the camera was, and the markers that touch the frame."""

    frame: Frame
    position_m: tuple[float, float, float]
    attitude: tuple[float, float, float, float]
    time_s: float
    markers: tuple[Marker, ...]
    weather: Weather


@dataclass(frozen=True, slots=True, kw_only=True)
class Print:
    """A marker as it lies on the ground."""

    marker_id: int
    place_m: tuple[float, float]
    yaw_rad: float = 0.0
    side_m: float = MARKER_SIDE_M


def random_scenario(rng: np.random.Generator, map: Map, weather: Weather) -> Scenario:
    """Draw a valid scenario; the sun takes its whole range in either weather."""
    genome = genome_for(map, weather="full")
    values = genome.random(rng)
    for index, key in enumerate(genome.keys):
        if key.startswith("environment.") and key != "environment.sun_position":
            extreme = weather == "full" and rng.random() < EXTREME_SHARE
            values[index] = rng.uniform(0, 1 if extreme else CONFINED_WEATHER)
    seed = int(rng.integers(2**31))
    return repair(decode(values, genome, map=map.name, seed=seed), map)


def pictures(
    rng: np.random.Generator,
    map: Map,
    weather: Weather,
    count: int,
    *,
    marker_id: int = TARGET_MARKER_ID,
) -> Iterator[Picture]:
    """Yield ``count`` pictures of one random scenario from random poses."""
    scenario = random_scenario(rng, map, weather)
    task = Task(marker=MarkerSpec(id=marker_id))
    renderer = Renderer(Placed(dataclasses.replace(scenario, task=task), map), CAMERA, rng)
    prints = [Print(marker_id=marker_id, place_m=renderer.marker_m)]
    prints += [
        Print(
            marker_id=layer.marker_id,
            place_m=layer.points_m[0],
            yaw_rad=layer.yaw_rad,
            side_m=layer.size_m,
        )
        for layer in map.ground.layers
        if layer.kind == "marker"
    ]
    for _ in range(count):
        aim = _aim(rng, prints, map)
        position, attitude = random_pose(rng, aim)
        objects = _objects(rng, map, aim)
        time_s = float(rng.uniform(0, 120))
        frame = renderer.render(position, attitude, time_s, objects)
        found = (truth(each, renderer, frame, position, attitude) for each in prints)
        yield Picture(
            frame=frame,
            position_m=position,
            attitude=attitude,
            time_s=time_s,
            markers=tuple(marker for marker in found if marker is not None),
            weather=weather,
        )


def random_pose(rng: np.random.Generator, aim: tuple[float, float]) -> Pose:
    """Draw a pose that has a place on the ground somewhere in the frame, or just outside."""
    low, high = HEIGHTS_M
    # Half of them uniform, as markers are harder to read from high up, half in the logarithm.
    height = float(rng.uniform(low, high))
    if rng.random() < 0.5:
        height = math.exp(rng.uniform(math.log(low), math.log(high)))
    tilt = min(MAX_TILT_RAD, abs(rng.normal(0, USUAL_TILT_RAD)))
    towards, yaw = rng.uniform(0, 2 * math.pi, 2)
    q = _product(
        (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)),
        (
            math.sin(tilt / 2) * math.cos(towards),
            math.sin(tilt / 2) * math.sin(towards),
            0.0,
            math.cos(tilt / 2),
        ),
    )
    view = View.of(CAMERA, (0.0, 0.0, height), q)
    u = rng.uniform(-0.05, 1.05) * CAMERA.width_px
    v = rng.uniform(-0.05, 1.05) * CAMERA.height_px
    x, y, scale = view.ground_of_pixel @ np.array([u, v, 1.0])
    return (aim[0] - float(x / scale), aim[1] - float(y / scale), height), q


def truth(
    mark: Print,
    renderer: Renderer,
    frame: Frame,
    position_m: tuple[float, float, float],
    attitude: tuple[float, float, float, float],
) -> Marker | None:
    """Return what is true about a marker, or None where none of it is in the frame."""
    view = View.of(CAMERA, position_m, attitude)
    steps = (np.arange(_PROBES) + 0.5) / _PROBES - 0.5
    across, down = np.meshgrid(steps, -steps)
    half = 0.5
    outline = np.array([[-half, half], [half, half], [half, -half], [-half, -half], [0, 0]])
    local = np.concatenate([np.column_stack([across.ravel(), down.ravel()]), outline])
    cos, sin = math.cos(mark.yaw_rad), math.sin(mark.yaw_rad)
    world = mark.side_m * local @ np.array([[cos, sin], [-sin, cos]]) + mark.place_m
    seen = world @ view.axes[:, :2].T - view.axes @ view.eye
    if seen[:, 2].min() <= 0.1:
        return None
    pixels = view.pixels(seen)
    probes, corners, centre = pixels[:-5], pixels[-5:-1], pixels[-1]
    columns, rows = np.round(probes).astype(int).T
    height, width = frame.segmentation.shape
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    if not inside.any():
        return None
    inner = np.flatnonzero(inside)
    open_to_view = frame.segmentation[rows[inner], columns[inner]] <= 1
    clear = open_to_view & ~renderer.covered(world[inner])
    grey = frame.image[rows[inner], columns[inner]].mean(axis=1)
    bits = np.kron(marker_bits(mark.marker_id), np.ones((3, 3), bool)).ravel()[inner]
    reach = np.abs(corners - centre).max(axis=0)
    return Marker(
        marker_id=mark.marker_id,
        place_m=mark.place_m,
        centre_px=(float(centre[0]) + 0.5, float(centre[1]) + 0.5),
        size_px=(2 * float(reach[0]), 2 * float(reach[1])),
        side_px=CAMERA.focal_px * mark.side_m / position_m[2],
        framed=len(inner) / _PROBES**2,
        hidden=1.0 - float(clear.mean()),
        contrast=_difference(grey[clear & bits], grey[clear & ~bits]),
    )


def _difference(white: NDArray[np.float64], black: NDArray[np.float64]) -> float:
    return float(white.mean() - black.mean()) if len(white) and len(black) else 0.0


def _aim(rng: np.random.Generator, prints: list[Print], map: Map) -> tuple[float, float]:
    """Choose what to look at: mostly the marker, else a decoy, else any place."""
    chance = rng.random()
    if chance < 0.65:
        return prints[0].place_m
    if chance < 0.85 and len(prints) > 1:
        return prints[1 + int(rng.integers(len(prints) - 1))].place_m
    x_min, x_max, y_min, y_max = map.bounds_m
    return float(rng.uniform(x_min, x_max)), float(rng.uniform(y_min, y_max))


def _objects(
    rng: np.random.Generator, map: Map, aim: tuple[float, float]
) -> list[tuple[tuple[float, float, float], float]]:
    """Put each object on or beside what is looked at, or somewhere."""
    x_min, x_max, y_min, y_max = map.bounds_m
    placed = []
    for _, kind in map.present_objects:
        if rng.random() < 0.3:
            x, y = rng.normal(aim, 0.8)
        else:
            x, y = rng.uniform((x_min, y_min), (x_max, y_max))
        at = (float(x), float(y), OBJECT_TYPES[kind].altitude_m)
        placed.append((at, float(rng.uniform(0, 2 * math.pi))))
    return placed


def _product(
    a: tuple[float, float, float, float], b: tuple[float, float, float, float]
) -> tuple[float, float, float, float]:
    """Multiply quaternions x, y, z, w: first ``b`` turns, then ``a``."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
