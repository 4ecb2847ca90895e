"""The topics of the camera: its pictures, its calibration, and what is where in the pictures."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
from foxglove.messages import (
    CameraCalibration,
    CircleAnnotation,
    CompressedImage,
    ImageAnnotations,
    PointsAnnotation,
    PointsAnnotationType,
    TextAnnotation,
    Timestamp,
)
from numpy.typing import NDArray

from pytest_garl.landing_system import Camera, Detection
from pytest_garl.messages import shortened
from pytest_garl.reports.film import drawing
from pytest_garl.reports.mcap.shown_pictures import ShownPicture, ShownPictures
from pytest_garl.reports.mcap.values import CAMERA_FRAME, Logged, colour, ns, pixel, stamp

IMAGE, CALIBRATION, ANNOTATIONS = "/camera/image", "/camera/calibration", "/camera/annotations"
QUALITY = 85
"""Of the JPEG: at 85 the marker can be read where it can be read in the picture itself."""
LINE_PX, FONT_PX = 2.0, 12.0
TARGET_PX = 8.0
_CLEAR = 0.0


def camera_topics(pictures: ShownPictures) -> Iterator[Logged]:
    """Yield picture, calibration and annotations of each picture, at the time when it was taken."""
    for picture in pictures:
        time_ns = ns(picture.time_s)
        for topic, message in (
            (CALIBRATION, calibration(pictures.camera, stamp(time_ns))),
            (IMAGE, _image(picture, stamp(time_ns))),
            (ANNOTATIONS, _annotations(pictures, picture, stamp(time_ns))),
        ):
            yield Logged(time_ns=time_ns, topic=topic, message=message)


def calibration(camera: Camera, time: Timestamp) -> CameraCalibration:
    """Return a camera's matrix and its distortion in OpenCV's order, as ROS names the models."""
    found = camera.distortion
    if len(found) > 5:
        model, coefficients = "rational_polynomial", found
    else:
        model, coefficients = "plumb_bob", (*found, *(0.0,) * (5 - len(found)))
    matrix = camera.matrix
    return CameraCalibration(
        timestamp=time,
        frame_id=CAMERA_FRAME,
        width=camera.width_px,
        height=camera.height_px,
        distortion_model=model,
        D=[float(value) for value in coefficients],
        K=matrix.ravel().tolist(),
        R=np.eye(3).ravel().tolist(),
        P=np.hstack([matrix, np.zeros((3, 1))]).ravel().tolist(),
    )


def _image(picture: ShownPicture, time: Timestamp) -> CompressedImage:
    bgr = cv2.cvtColor(picture.image, cv2.COLOR_RGB2BGR)
    _, content = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    return CompressedImage(
        timestamp=time, frame_id=CAMERA_FRAME, data=content.tobytes(), format="jpeg"
    )


def _annotations(
    pictures: ShownPictures, picture: ShownPicture, time: Timestamp
) -> ImageAnnotations:
    """Return the marker's true outline, and what the system reported of this very picture."""
    points: list[PointsAnnotation] = []
    circles: list[CircleAnnotation] = []
    texts: list[TextAnnotation] = []
    if _touches(picture.outline_px, pictures.camera):
        points.append(_outline(picture.outline_px, drawing.MARKER, time))
    diagnostics = picture.step.diagnostics
    for found in diagnostics.detections if diagnostics else ():
        if found.corners_px:
            corners = np.array(found.corners_px)
            points.append(_outline(corners, drawing.SYSTEM, time))
            texts.append(_label(found, corners, time))
        else:
            circles += _circle(pictures, picture, found.position_m, time)
    if diagnostics and diagnostics.target_m is not None:
        circles += _circle(pictures, picture, diagnostics.target_m, time)
    return ImageAnnotations(timestamp=time, points=points, circles=circles, texts=texts)


def _touches(outline_px: NDArray[np.float32], camera: Camera) -> bool:
    """Whether the box of an outline touches the picture."""
    if len(outline_px) < 3:
        return False
    (left, top), (right, low) = outline_px.min(axis=0), outline_px.max(axis=0)
    return bool(
        right > -0.5
        and left < camera.width_px - 0.5
        and low > -0.5
        and top < camera.height_px - 0.5
    )


def _outline(
    corners_px: NDArray[np.floating], rgb: drawing.Colour, time: Timestamp
) -> PointsAnnotation:
    return PointsAnnotation(
        timestamp=time,
        type=PointsAnnotationType.LineLoop,
        points=[pixel(corner) for corner in corners_px.tolist()],
        outline_color=colour(rgb),
        fill_color=colour(rgb, _CLEAR),
        thickness=LINE_PX,
    )


def _label(found: Detection, corners_px: NDArray[np.float64], time: Timestamp) -> TextAnnotation:
    low = corners_px[np.argmax(corners_px[:, 1])]
    return TextAnnotation(
        timestamp=time,
        position=pixel((float(low[0]), float(low[1]) + FONT_PX)),
        text=shortened(f"id {found.marker_id}  {found.confidence:.2f}"),
        font_size=FONT_PX,
        text_color=colour(drawing.SYSTEM),
        background_color=colour(drawing.BACKGROUND, 0.7),
    )


def _circle(
    pictures: ShownPictures,
    picture: ShownPicture,
    place_m: tuple[float, float, float],
    time: Timestamp,
) -> list[CircleAnnotation]:
    """Return a circle around a place that the system reports, in its own frame; none behind."""
    x, y, z = (a - b for a, b in zip(place_m, picture.step.estimation_error_m, strict=True))
    at = pictures.pixel_of(picture, (x, y, z))
    if at is None or max(abs(each) for each in at) > 10_000:
        return []
    return [
        CircleAnnotation(
            timestamp=time,
            position=pixel(at),
            diameter=2 * TARGET_PX,
            thickness=LINE_PX,
            fill_color=colour(drawing.SYSTEM, _CLEAR),
            outline_color=colour(drawing.SYSTEM),
        )
    ]
