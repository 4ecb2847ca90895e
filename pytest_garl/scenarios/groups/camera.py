"""Camera: how the true camera differs from what the airframe says."""

from __future__ import annotations

from pytest_garl.scenarios.groups.parameter import Group, Parameter


def _mounting(axis: str, meaning: str) -> Parameter:
    return Parameter(
        name=f"mounting_{axis}_deg",
        nominal=0.0,
        low=-15.0,
        high=15.0,
        meaning=f"true camera turned from the declared one: {meaning}; the depth camera with it",
        source="engineering estimate: a bracket mounted by hand, without a calibration",
    )


GROUP = Group(
    name="camera",
    meaning="a camera that differs from what the airframe says",
    parameters=(
        _mounting("roll", "it looks to the left"),
        _mounting("pitch", "it looks backwards"),
        _mounting("yaw", "the image's top turns to the left"),
        Parameter(
            name="calibration_error_percent",
            nominal=0.0,
            low=-20.0,
            high=20.0,
            meaning="by how much the true focal length is longer than that of Camera.matrix",
            source="engineering estimate: the nominal focal length instead of a calibrated one",
        ),
    ),
)
