"""TPH-YOLO as a detector: from a frame to markers with their places and confidences."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from landing_systems.modules.detection_opencv import CAMERA_FROM_BODY, rotation_matrix
from landing_systems.modules.detection_tphyolo.decoding import (
    BITS,
    CLASS_IDS,
    NETWORK_SIZE,
    class_logit,
    decode,
    joint_logit,
)
from landing_systems.modules.detection_tphyolo.patches import PADDING, normalised, patch
from landing_systems.modules.detection_tphyolo.weights import SHIPPED, read_weights
from landing_systems.modules.lens import undistorted
from pytest_garl import Camera, Detection, Mission, Observation

LARGEST_SIDE_PX = 64.0
"""A marker that is larger according to the altimeter is shrunk to this: the network has been
trained for sizes up to it."""
MIN_CONFIDENCE = 0.25
"""TPH-YOLOv5's default; the decision asks for more."""
SIZE_TOLERANCE = 1.6
"""A box is a marker's only if its size is that of a marker on the ground below, within this
factor: the outline of a turned marker is up to 1.41 times as wide as the marker."""
MIN_HEIGHT_M = 0.3
WHOLE_BELOW_M = 2.0
"""Lower than this, where it is landed on, a marker counts only if the frame does not cut it: the
middle of one that is cut is a guess, off by up to 0.4 m.  From higher up it shows the way."""
MAX_MARKERS = 6
"""Largest number that is read, so that an unusual frame takes no longer than others."""
_EDGE_PX = 1.0


class TphYoloDetector:
    """Finds markers in frames by the learned network and places them in the world.

    Below ``whole_below_m`` a marker that the frame cuts does not count.  Raises WeightsError for
    weights that are missing, damaged or not what their manifest says, ValueError for a marker that
    the network does not know.
    """

    def __init__(
        self,
        mission: Mission,
        weights: Path = SHIPPED,
        *,
        min_confidence: float = MIN_CONFIDENCE,
        whole_below_m: float = WHOLE_BELOW_M,
    ) -> None:
        if not mission.marker_dictionary.startswith(BITS) or mission.marker_id not in CLASS_IDS:
            raise ValueError(
                f"TPH-YOLO: found marker {mission.marker_id} of {mission.marker_dictionary}, "
                f"expected one of {', '.join(map(str, CLASS_IDS))} of DICT_5X5_50, which its "
                "network was trained on; take such a marker, train the network "
                "(lab/train_detector), or use OpenCV-MLS"
            )
        files = read_weights(weights)
        self._boxes, self._ids = load_network(files.boxes), load_network(files.ids)
        self._slope, self._offset = files.calibration
        self._camera: Camera = mission.camera
        self._side_m = mission.marker_side_m
        self._min_confidence, self._whole_below_m = min_confidence, whole_below_m
        self._min_logit = (_logit(min_confidence) - self._offset) / self._slope

    def detect(self, observation: Observation) -> tuple[Detection, ...]:
        """Return all markers in the frame whose size fits the height, the surest first."""
        height = max(MIN_HEIGHT_M, float(observation.position_m[2]))
        side_px = self._camera.focal_px * self._side_m / height
        picture, scale, shift = fitted(observation.image, side_px)
        self._boxes.setInput(cv2.dnn.blobFromImage(picture, 1 / 255))
        raw = np.asarray(self._boxes.forward(), np.float32)[0]
        # A product of two probabilities is below either: what is left out here is lost anyway.
        boxes = decode(raw, *NETWORK_SIZE, self._min_logit)
        found = []
        for centre, size, logit in zip(boxes.centres_px, boxes.sizes_px, boxes.logits, strict=True):
            middle = (centre - shift) / scale
            place = self._place(middle, size / scale, side_px, observation)
            if place is None or (height < self._whole_below_m and self._cut(middle, size / scale)):
                continue
            (x, y), expected_px = place
            number, answer = self._identify(picture, centre, expected_px * scale)
            confidence = self.confidence(joint_logit(float(logit), answer))
            if confidence >= self._min_confidence:
                found.append(
                    Detection(
                        marker_id=CLASS_IDS[number],
                        confidence=confidence,
                        position_m=(x, y, 0.0),
                        corners_px=_corners(middle, size / scale),
                    )
                )
            if len(found) == MAX_MARKERS:
                break
        return tuple(sorted(found, key=lambda each: -each.confidence))

    def confidence(self, logit: float) -> float:
        """Return the calibrated probability that a box is a marker of its class."""
        return float(1 / (1 + np.exp(-(self._slope * logit + self._offset))))

    def _cut(self, centre: NDArray[np.float32], size: NDArray[np.float32]) -> bool:
        """Whether a box (pixel edges of the frame) reaches the frame's edge."""
        low, high = centre - size / 2, centre + size / 2
        frame = (self._camera.width_px, self._camera.height_px)
        return bool((low < _EDGE_PX).any() or (high > np.subtract(frame, _EDGE_PX)).any())

    def _identify(
        self, picture: NDArray[np.uint8], centre: NDArray[np.float32], side_px: float
    ) -> tuple[int, float]:
        """Return the likeliest class of what a box holds, and its logit."""
        cut = patch(picture, (float(centre[0]), float(centre[1])), side_px)
        self._ids.setInput(normalised(cut[None]))
        return class_logit(np.asarray(self._ids.forward(), np.float32)[0])

    def _place(
        self,
        centre: NDArray[np.float32],
        size: NDArray[np.float32],
        side_px: float,
        observation: Observation,
    ) -> tuple[tuple[float, float], float] | None:
        """Return where a box of the frame lies on the ground, and its marker's side in pixels.

        None where it does not look like a marker on the ground.
        """
        found = ground_place(centre, self._camera, observation)
        if found is None:
            return None
        place, nearer = found
        expected, width = side_px * nearer, math.sqrt(float(size.prod()))
        least, most = expected / SIZE_TOLERANCE, math.sqrt(2) * expected * SIZE_TOLERANCE
        return (place, expected) if least < width < most else None


def load_network(file: Path) -> cv2.dnn.Net:
    """Return a network from its ONNX file."""
    # The engine that OpenCV 5.0 prefers refuses the network (an assertion about shapes),
    # and it ignores which one is asked for where it reads from memory.
    return cv2.dnn.readNetFromONNX(str(file), engine=cv2.dnn.ENGINE_CLASSIC)


def _logit(chance: float) -> float:
    return math.log(chance / (1 - chance))


def _corners(
    centre: NDArray[np.float32], size: NDArray[np.float32]
) -> tuple[tuple[float, float], ...]:
    """Return a box's corners in pixels, whose centres are at whole numbers."""
    (left, top), (right, bottom) = centre - size / 2 - 0.5, centre + size / 2 - 0.5
    corners = ((left, top), (right, top), (right, bottom), (left, bottom))
    return tuple((float(u), float(v)) for u, v in corners)


def ground_place(
    centre_px: NDArray[np.float32], camera: Camera, observation: Observation
) -> tuple[tuple[float, float], float] | None:
    """Return where the ray through a picture's place (pixel edges) meets the ground.

    Also how much nearer than straight below, in planar depth, it does: 1 with a level camera.
    None where the ray does not go down.
    """
    (cx, cy), focal = camera.centre_px, camera.focal_px
    u, v = (
        undistorted(np.asarray(centre_px)[None] - 0.5, camera)[0]
        if camera.distortion
        else (
            centre_px[0] - 0.5,
            centre_px[1] - 0.5,
        )
    )
    across, down = (u - cx) / focal, (v - cy) / focal
    in_body = CAMERA_FROM_BODY.T @ np.array([across, down, 1.0])
    ray = rotation_matrix(observation.attitude) @ in_body
    if ray[2] > -1e-3:
        return None
    depth = float(observation.position_m[2]) / -ray[2]
    x, y = observation.position_m[:2] + depth * ray[:2]
    return (float(x), float(y)), float(-ray[2])


def shrink(side_px: float) -> float:
    """Return the scale at which a marker of this size is looked at."""
    return min(1.0, LARGEST_SIDE_PX / side_px) if side_px > 0 else 1.0


def fitted(
    image: NDArray[np.uint8], side_px: float
) -> tuple[NDArray[np.uint8], float, tuple[float, float]]:
    """Return the frame in the middle of the network's picture, its scale and its shift."""
    width, height = NETWORK_SIZE
    rows, columns = image.shape[:2]
    scale = min(shrink(side_px), width / columns, height / rows)
    if scale == 1.0 and (columns, rows) == NETWORK_SIZE:
        return image, 1.0, (0.0, 0.0)
    inner = (max(1, round(columns * scale)), max(1, round(rows * scale)))
    left, top = (width - inner[0]) // 2, (height - inner[1]) // 2
    picture = np.full((height, width, 3), PADDING, np.uint8)
    picture[top : top + inner[1], left : left + inner[0]] = cv2.resize(
        image, inner, interpolation=cv2.INTER_AREA
    )
    return picture, scale, (float(left), float(top))
