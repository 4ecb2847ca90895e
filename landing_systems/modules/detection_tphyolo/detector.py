"""TPH-YOLO as a detector: from a frame to markers with their places and confidences."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from landing_systems.modules.detection_opencv import CAMERA_FROM_BODY, rotation_matrix
from landing_systems.modules.detection_tphyolo.decoding import (
    CLASS_IDS,
    NETWORK_SIZE,
    Boxes,
    decode,
)
from landing_systems.modules.detection_tphyolo.weights import SHIPPED, read_weights
from pytest_garl import Camera, Detection, Mission, Observation

PADDING = 114
"""The grey about a frame that is smaller than what the network takes, as in YOLOv5."""
LARGEST_SIDE_PX = 64.0
"""A marker that is larger according to the altimeter is shrunk to this: the network has been
trained for sizes up to it."""
MIN_CONFIDENCE = 0.25
"""TPH-YOLOv5's default; the decision asks for more."""
SIZE_TOLERANCE = 1.6
"""A box is a marker's only if its size is that of a marker on the ground below, within this
factor: the outline of a turned marker is up to 1.41 times as wide as the marker."""
MIN_HEIGHT_M = 0.3


class TphYoloDetector:
    """Finds markers in frames by the learned network and places them in the world.

    Raises WeightsError for weights that are missing, damaged or not what their manifest says.
    """

    def __init__(self, mission: Mission, weights: Path = SHIPPED) -> None:
        content, manifest = read_weights(weights)
        self._net = cv2.dnn.readNetFromONNX(
            # OpenCV 5.0's own engine refuses the network (an assertion about shapes).
            np.frombuffer(content, np.uint8),
            engine=cv2.dnn.ENGINE_CLASSIC,
        )
        self._slope, self._offset = manifest.calibration
        self._camera: Camera = mission.camera
        self._side_m = mission.marker_side_m
        self._min_logit = self._logit_of(MIN_CONFIDENCE)

    def detect(self, observation: Observation) -> tuple[Detection, ...]:
        """Return all markers in the frame whose size fits the height, the surest first."""
        height = max(MIN_HEIGHT_M, float(observation.position_m[2]))
        side_px = self._camera.focal_px * self._side_m / height
        boxes, scale, shift = self.boxes(observation.image, side_px)
        found = []
        for index in range(len(boxes.logits)):
            centre = (boxes.centres_px[index] - shift) / scale
            size = boxes.sizes_px[index] / scale
            detection = self._placed(centre, size, side_px, boxes, index, observation)
            if detection is not None:
                found.append(detection)
        return tuple(found)

    def boxes(
        self, image: NDArray[np.uint8], side_px: float
    ) -> tuple[Boxes, float, tuple[float, float]]:
        """Return boxes in the network's picture, and the frame's scale and shift in it.

        ``side_px`` is how wide a marker should be in the frame.
        """
        picture, scale, shift = fitted(image, side_px)
        self._net.setInput(cv2.dnn.blobFromImage(picture, 1 / 255))
        raw = np.asarray(self._net.forward(), np.float32)
        return decode(raw[0], *NETWORK_SIZE, self._min_logit), scale, shift

    def confidence(self, logit: float) -> float:
        """Return the calibrated probability that a box is a marker of its class."""
        return 1 / (1 + math.exp(-(self._slope * logit + self._offset)))

    def _logit_of(self, confidence: float) -> float:
        return (math.log(confidence / (1 - confidence)) - self._offset) / self._slope

    def _placed(
        self,
        centre: NDArray[np.float32],
        size: NDArray[np.float32],
        side_px: float,
        boxes: Boxes,
        index: int,
        observation: Observation,
    ) -> Detection | None:
        place = ground_place(centre, self._camera, observation)
        if place is None:
            return None
        (x, y), stretch = place
        expected = side_px * stretch
        if not expected / SIZE_TOLERANCE < math.sqrt(float(size.prod())) < (
            math.sqrt(2) * expected * SIZE_TOLERANCE
        ):
            return None
        (left, top), (right, bottom) = centre - size / 2 - 0.5, centre + size / 2 - 0.5
        corners = ((left, top), (right, top), (right, bottom), (left, bottom))
        return Detection(
            marker_id=CLASS_IDS[int(boxes.classes[index])],
            confidence=self.confidence(float(boxes.logits[index])),
            position_m=(x, y, 0.0),
            corners_px=tuple((float(u), float(v)) for u, v in corners),
        )


def ground_place(
    centre_px: NDArray[np.float32], camera: Camera, observation: Observation
) -> tuple[tuple[float, float], float] | None:
    """Return where the ray through a picture's place (pixel edges) meets the ground.

    Also how much nearer than straight below, in planar depth, it does: 1 with a level camera.
    None where the ray does not go down.
    """
    (cx, cy), focal = camera.centre_px, camera.focal_px
    across, down = (centre_px[0] - 0.5 - cx) / focal, (centre_px[1] - 0.5 - cy) / focal
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
