"""The downward camera: a compositor that gives colour, depth and segmentation.

A picture has one plane, the ground, and a few boxes and bodies above it, so it is composed in
place of traced, with OpenCV on one thread: the same bytes on every CPU of a class, in milliseconds.
A frame has two parts:

1. *At once*, since the system under test or a property may need it: the depth of each pixel from
   the plane (``projection.py``), the marker's outline in the segmentation, and the solids, drawn
   into both (``solids.py``).
2. *When it is asked for*, since no system looks at every picture: the colour, and how well the
   marker can be seen (``marker_sight.py``).  Both read the scene of their frame, whatever was drawn
   since.

The colour, in the order in which light goes:

3. The ground, painted once for each scenario at two scales, the wide one and a fine inset about the
   marker, and warped into the picture from the level whose pixels are as large as the picture's
   (``ground.py``).
4. Shadows and gloss on it, the sky, then the solids that stand before it.
5. Particles of rain, snow, dust and leaves, each before or behind what lies in its place.
6. Fog, by the path of the light through the air.
7. The camera: movement while it is exposed, the lens's distortion, dirt on the lens, then the
   sensor's gain, noise and colour (``exposure.py``, ``lens.py``, ``image_sensor.py``).

A lens bends what a pinhole saw, so all before step 7 is a pinhole's, and the depth and segmentation
are bent with it.  An example: the shadow of a tree falls on the marker in fog.  Step 1 gives the
marker's pixels, step 4 darkens a part of them, step 6 takes contrast from all, and ``marker_sight``
gives the same two losses as numbers, from which verdicts say whether somebody could have read it.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.errors import GarlError
from pytest_garl.flight.flight import MarkerView
from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.placed import Pad, Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera.exposure import STILL, Exposure, Movement, Optics
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.camera.gloss import add_gloss, gloss_of
from pytest_garl.simulation.camera.ground import PaintedGround, Raster, paint_ground, repaint
from pytest_garl.simulation.camera.ground_cover import cover_shift, covered
from pytest_garl.simulation.camera.image_sensor import Sensor
from pytest_garl.simulation.camera.lens import lens_of
from pytest_garl.simulation.camera.marker_patch import paint_patch
from pytest_garl.simulation.camera.marker_sight import BoardSight, MarkerSight
from pytest_garl.simulation.camera.particles import Particles
from pytest_garl.simulation.camera.projection import FAR_M, NEAR_M, View, ground_depth
from pytest_garl.simulation.camera.solids import (
    BodyPose,
    PaintedSolid,
    Shadow,
    Solids,
    draw_shadows,
)
from pytest_garl.simulation.camera.weather import Conditions, conditions_of

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Array = NDArray[np.float32]
_SHIFT = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Look:
    """The effects of one environment on pictures."""

    conditions: Conditions
    sensor: Sensor
    particles: Particles
    decay: Array
    air: NDArray[np.uint8]
    veil: NDArray[np.uint8]
    sight: BoardSight


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Scene:
    """Everything that is painted in one frame."""

    view: View
    time_s: float
    depth_m: Array
    footprint_m: float
    inset_footprint_m: float
    sky: NDArray[np.bool_] | None
    shadows: Sequence[Shadow]
    layers: Sequence[PaintedSolid]
    ground: PaintedGround | None
    look: _Look
    exposure: Exposure
    segmentation: NDArray[np.int32]


class Renderer:
    """Draws what the camera sees in one scenario; a frame is a pure function of its arguments.

    ``segment_ids`` numbers ground (0), marker (1), static bodies and dynamic objects.
    With ``colour=False`` no ground is painted: such a renderer gives frames without images.
    """

    def __init__(
        self,
        placed: Placed,
        camera: Camera,
        rng: np.random.Generator,
        *,
        colour: bool = True,
    ) -> None:
        scenario, map = placed.scenario, placed.map
        self.camera, self._lens = camera, lens_of(camera)
        # What is drawn is what a pinhole sees; a lens bends it.
        self._drawn = drawn = self._lens.pinhole if self._lens else camera
        conditions = conditions_of(scenario)
        self.pad, self._map = placed.pad, map
        self._optics = Optics(scenario, camera)
        self.marker_m = self.pad.place_m
        self._outline_m = np.array(self.pad.main.outline_m)
        names = ["ground", "marker", *(body.name for body in map.bodies)]
        names += [name for name, _ in map.present_objects]
        self.segment_ids: Mapping[str, int] = {name: index for index, name in enumerate(names)}
        self._shift = cover_shift(rng)
        self._ground: PaintedGround | None = None
        if colour:
            self._ground = paint_ground(map, conditions, self._shift, self.pad)
        width, height = drawn.width_px, drawn.height_px
        (cx, cy), focal = drawn.centre_px, drawn.focal_px
        self._columns = np.arange(width, dtype=np.float32)
        self._rows = np.arange(height, dtype=np.float32)[:, None]
        across, down = (self._columns - cx) / focal, (self._rows - cy) / focal
        self._stretch = np.sqrt(1 + across**2 + down**2)
        self._before_draws = copy.deepcopy(rng)
        self._prepare(conditions, rng)

    def with_pad(self, pad: Pad) -> Renderer:
        """Return what draws another pad in its place, with the same draws of chance."""
        other = Renderer.__new__(Renderer)
        vars(other).update(vars(self))
        other.pad, other._outline_m = pad, np.array(pad.main.outline_m)
        if self._ground is not None:
            other._ground = paint_ground(self._map, self.conditions, self._shift, pad)
        look = self._look
        sight = other._sight_of(look.conditions, look.sensor, look.particles)
        other._look = dataclasses.replace(look, sight=sight)
        return other

    @property
    def conditions(self) -> Conditions:
        """The environment that frames show now."""
        return self._look.conditions

    @property
    def ground(self) -> PaintedGround | None:
        """The ground as it is painted now; None without colour."""
        return self._ground

    def change(self, scenario: Scenario) -> None:
        """Show the environment of ``scenario`` from the next frame on.

        Its other genes must be those of the renderer's own; frames are then what they would be
        had the renderer been made with it.
        """
        before, conditions = self.conditions, conditions_of(scenario)
        if self._ground is not None:
            self._ground = repaint(self._ground, self.pad, self._map, before, conditions)
        self._prepare(conditions, copy.deepcopy(self._before_draws))

    def _prepare(self, conditions: Conditions, rng: np.random.Generator) -> None:
        """Make all that draws frames under these conditions, but the ground."""
        self._solids = Solids(self._map, conditions, self.segment_ids)
        airlight = np.array(conditions.airlight)
        veil = (1 - np.arange(256) / 255)[:, None] * airlight
        sensor = Sensor(self.camera, conditions, rng)
        particles = Particles(self._drawn, conditions, rng)
        self._look = _Look(
            conditions=conditions,
            sensor=sensor,
            particles=particles,
            sight=self._sight_of(conditions, sensor, particles),
            decay=(-conditions.extinction_per_m * self._stretch).astype(np.float32),
            air=airlight.astype(np.uint8),
            veil=np.round(veil).astype(np.uint8).reshape(1, 256, 3),
        )

    def _sight_of(self, conditions: Conditions, sensor: Sensor, particles: Particles) -> BoardSight:
        pad = self.pad
        patches = [
            paint_patch(each, pad, self._map, conditions, self._shift) for each in pad.markers
        ]
        return BoardSight(
            [
                MarkerSight(self._drawn, self._lens, patch, conditions, sensor, particles)
                for patch in patches
            ]
        )

    def render(
        self,
        position_m: Vector,
        attitude: Quaternion,
        time_s: float,
        objects: Sequence[BodyPose],
        movement: Movement = STILL,
    ) -> Frame:
        """Return the frame from a camera at ``position_m`` with the UAV's ``attitude``.

        ``objects`` are the (position, yaw) of the dynamic objects in order; ``movement`` blurs.
        """
        view = View.of(self._drawn, position_m, attitude)
        depth, horizon = ground_depth(view, self._columns, self._rows)
        segmentation = np.zeros(depth.shape, np.int32)
        if horizon:
            segmentation[depth >= FAR_M] = -1
        outline = self._outline(view)
        marker = _draw_marker(segmentation, view, self.pad, outline)
        sky = segmentation < 0 if horizon else None
        footprint = float(depth[depth.shape[0] // 2, depth.shape[1] // 2]) / self.camera.focal_px
        self._solids.place(objects)
        shadows = self._solids.shadows()
        pixels, layers = self._solids.draw(depth, segmentation, view)
        pixels[1] = np.count_nonzero(segmentation[marker] == 1)
        scene = _Scene(
            view=view,
            time_s=time_s,
            depth_m=depth,
            footprint_m=footprint,
            inset_footprint_m=self._inset_footprint_m(view, footprint),
            sky=sky,
            shadows=shadows,
            layers=layers,
            ground=self._ground,
            look=self._look,
            exposure=self._optics.exposure(view, movement),
            segmentation=segmentation,
        )
        if self._lens:
            depth, segmentation = self._lens.nearest(depth), self._lens.nearest(segmentation)
            pixels[1:] = np.bincount(segmentation[segmentation > 0], minlength=len(pixels))[1:]
        return Frame(
            paint=functools.partial(self._paint, scene),
            marker=functools.partial(self._marker_view, scene),
            marker_area_px=functools.partial(self._marker_area_px, view, outline),
            depth_m=depth,
            segmentation=segmentation,
            pixels=pixels,
        )

    def _inset_footprint_m(self, view: View, middle_m: float) -> float:
        """Return the size of a pixel on the ground about the marker.

        ``middle_m`` is that in the picture's middle: the same under a camera that looks down.
        """
        if not self._drawn.is_turned:
            return middle_m
        x, y = self.pad.place_m
        depth = float(view.axes[2] @ (np.array([x, y, 0.0]) - view.eye))
        return depth / self.camera.focal_px if depth > NEAR_M else middle_m

    def _marker_view(self, scene: _Scene) -> MarkerView | None:
        gloss = gloss_of(scene.view, scene.look.conditions, self.camera.focal_px)
        return scene.look.sight.view(
            scene.view, scene.segmentation, scene.layers, scene.shadows, gloss, scene.exposure
        )

    def _paint(self, scene: _Scene) -> NDArray[np.uint8]:
        """Paint from the ground up, whatever the renderer has drawn since."""
        view, look = scene.view, scene.look
        image = _ground_image(scene)
        draw_shadows(image, view, scene.shadows, look.conditions)
        add_gloss(image, view, gloss_of(view, look.conditions, self.camera.focal_px))
        if scene.sky is not None:
            image[scene.sky] = look.air
        for layer in scene.layers:
            layer.paint_onto(image)
        look.particles.draw(image, scene.depth_m, view, scene.time_s)
        _fog(image, scene.depth_m, look)
        image = scene.exposure.moved(image)
        if self._lens:
            image = self._lens.picture(image)
        return look.sensor.expose(scene.exposure.soiled(image), scene.time_s)

    def marker_pixels(self, position_m: Vector, attitude: Quaternion) -> int:
        """Count the marker's pixels in a frame with nothing in front of it."""
        view = View.of(self._drawn, position_m, attitude)
        return self._marker_pixels(view, self._outline(view))

    def _marker_pixels(self, view: View, outline: Array) -> int:
        segmentation = np.zeros((self._drawn.height_px, self._drawn.width_px), np.int32)
        _draw_marker(segmentation, view, self.pad, outline)
        if self._lens:
            segmentation = self._lens.nearest(segmentation)
        return int(np.count_nonzero(segmentation))

    def covered(self, places_m: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether places (n, 2) on the ground lie under leaves or snow, shape (n,)."""
        return covered(places_m, self._shift, self.conditions)

    def _marker_area_px(self, view: View, outline: Array) -> float:
        if self._lens:
            return float(self._marker_pixels(view, outline))
        if len(outline) < 3:
            return 0.0
        width, height = self.camera.width_px, self.camera.height_px
        frame = np.array(
            [[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]],
            np.float32,
        )
        area, _ = cv2.intersectConvexConvex(outline, frame)
        return float(area)

    def marker_side_px(self, height_m: float) -> float:
        """Side in pixels of the marker seen from straight above."""
        return self.camera.focal_px * self.pad.spec.side_m / height_m

    def marker_outline(self, position_m: Vector, attitude: Quaternion) -> Array:
        """Return the pixels (n, 2) about which the marker lies, also outside of the picture."""
        corners = self._outline(View.of(self._drawn, position_m, attitude))
        return self._lens.shown(_rounded(corners)) if self._lens else corners

    def _outline(self, view: View) -> Array:
        """Return the corners (n, 2) of the marker in a view as a pinhole shows them."""
        return view.ground_polygon(self._outline_m)


def _rounded(corners: Array) -> Array:
    """Return a polygon's corners (n, 2) with places on its sides, because a lens bends them."""
    parts = np.arange(8)[:, None] / 8
    sides = [a + (b - a) * parts for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)]
    return np.concatenate(sides).astype(np.float32) if sides else corners


def _draw_marker(
    segmentation: NDArray[np.int32], view: View, pad: Pad, outline: Array
) -> tuple[slice, slice]:
    """Draw the marker's segment; return the rows and columns that hold it."""
    if len(outline) < 3:
        return slice(0, 0), slice(0, 0)
    points = np.round(outline * 2**_SHIFT).astype(np.int32)
    cv2.fillConvexPoly(segmentation, points, (1.0,), cv2.LINE_8, _SHIFT)
    if pad.covered_share > 0:
        cover = view.ground_polygon(np.array(pad.cover_m))
        if len(cover) >= 3:
            fixed = np.round(cover * 2**_SHIFT).astype(np.int32)
            cv2.fillConvexPoly(segmentation, fixed, (0.0,), cv2.LINE_8, _SHIFT)
    return view.box(outline)


def _ground_image(scene: _Scene) -> NDArray[np.uint8]:
    view, ground, footprint = scene.view, _painted(scene.ground), scene.inset_footprint_m
    world = view.ground_of_pixel
    height, width = scene.depth_m.shape
    # Four channels: warpPerspective is 2.5 times as fast as with three.
    image = np.empty((height, width, 4), np.uint8)
    inset = ground.inset
    rows, columns = slice(0, height), slice(0, width)
    if scene.sky is not None or not _stays_within(image, *_scaled(inset, world, footprint)):
        _warp(ground.wide, image, world, scene.footprint_m, cv2.BORDER_REFLECT_101)
        rows, columns = view.box(view.ground_polygon(inset.outline))
    part = image[rows, columns]
    if part.size:
        shift = np.array([[1.0, 0.0, columns.start], [0.0, 1.0, rows.start], [0.0, 0.0, 1.0]])
        _warp(inset, part, world @ shift, footprint, cv2.BORDER_TRANSPARENT)
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGBA2RGB), dtype=np.uint8)


def _painted(ground: PaintedGround | None) -> PaintedGround:
    if ground is None:
        raise GarlError("this renderer was made with colour=False; it has no ground to show")
    return ground


def _fog(image: NDArray[np.uint8], depth: Array, look: _Look) -> None:
    """Let the air hide what is far: I = J t + A (1 - t) with t = exp(-extinction x path)."""
    if look.conditions.extinction_per_m > 0:
        # In bytes: a level of transmission is a level of grey at most.
        through = cv2.convertScaleAbs(cv2.exp(cv2.multiply(depth, look.decay)), alpha=255)
        through = cv2.cvtColor(through, cv2.COLOR_GRAY2RGB)
        cv2.multiply(image, through, image, 1 / 255)
        cv2.add(image, cv2.LUT(through, look.veil), image)


def _warp(
    raster: Raster,
    image: NDArray[np.uint8],
    world: NDArray[np.float64],
    footprint_m: float,
    border: int,
) -> None:
    source, pixel_of_pixel = _scaled(raster, world, footprint_m)
    if border == cv2.BORDER_REFLECT_101 and _stays_within(image, source, pixel_of_pixel):
        # The same bytes in two thirds of the time: nothing is reflected.
        border = cv2.BORDER_CONSTANT
    cv2.warpPerspective(
        source,
        pixel_of_pixel,
        (image.shape[1], image.shape[0]),
        image,
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=border,
    )


def _scaled(
    raster: Raster, world: NDArray[np.float64], footprint_m: float
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Return the level of a raster that has pixels of that size, and the map to its pixels."""
    wanted = math.log2(max(footprint_m / raster.m_per_px, 1e-6))
    level = min(len(raster.levels) - 1, max(0, round(wanted)))
    return raster.levels[level], raster.pixel_of_world(level) @ world


def _stays_within(
    image: NDArray[np.uint8], source: NDArray[np.uint8], pixel_of_pixel: NDArray[np.float64]
) -> bool:
    """Whether a map from the pixels of an image leads to pixels well inside another one only."""
    (height, width), (rows, columns) = image.shape[:2], source.shape[:2]
    right, bottom = width - 1.0, height - 1.0
    corners = np.array([[0, right, right, 0], [0, 0, bottom, bottom], [1, 1, 1, 1]])
    u, v, w = (pixel_of_pixel @ corners).tolist()
    # Between corners of one sign a straight line stays straight.
    if not (min(w) > 0 or max(w) < 0):
        return False
    places = [(x / z, y / z) for x, y, z in zip(u, v, w, strict=True)]
    return all(1 <= x <= columns - 2 and 1 <= y <= rows - 2 for x, y in places)
