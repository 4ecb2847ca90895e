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
        Parameter(
            name="exposure_ms",
            nominal=0.0,
            low=0.0,
            high=100.0,
            meaning="exposure time, at most the time between two frames: the UAV's own movement "
            "during it blurs the picture; its brightness stays as it is; 0: no blur",
            source="libcamera's tuning for the Raspberry Pi's cameras: in low light the time grows "
            "from 0.1 over 10, 30 and 60 to 66.7 ms while the gain does (ethoscope issue 222 "
            "measured 66.7 ms); 33 ms is the most at 30 Hz; picamera2 issue 1077 sets 0.2 ms to "
            "land on a marker",
        ),
        Parameter(
            name="dirt_percent",
            nominal=0.0,
            low=0.0,
            high=80.0,
            meaning="share of the picture behind soft patches of dirt on the lens, which stay for "
            "the flight; the depth camera is clean",
            source="Gu et al. 2009 for the effect: dirt attenuates and scatters, out of focus; the "
            "share is an engineering estimate: drops and dust of a dusty or muddy pad",
        ),
    ),
)
