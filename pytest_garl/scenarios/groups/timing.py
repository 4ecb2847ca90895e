"""Timing: observations that arrive late, unevenly, not at all, or with a wrong stamp."""

from __future__ import annotations

from pytest_garl.scenarios.groups.parameter import Group, Parameter

GROUP = Group(
    name="timing",
    meaning="late, uneven and lost frames, and wrong stamps",
    parameters=(
        Parameter(
            name="latency_ms",
            nominal=0.0,
            low=0.0,
            high=1000.0,
            meaning="delay of every frame beyond the latency that the airframe declares",
            source="ArduPilot pull request 7046: 50 to 200 ms in most visual landing systems",
        ),
        Parameter(
            name="jitter_ms",
            nominal=0.0,
            low=0.0,
            high=500.0,
            meaning="further delay, drawn for each frame from 0 to this; frames keep their order",
            source="PX4 pull request 9050: 20 to 50 ms of varying latency at a high frame rate; "
            "zed-ros-wrapper issue 581: 18 to 47 ms between frames at 30 Hz",
        ),
        Parameter(
            name="dropped_percent",
            nominal=0.0,
            low=0.0,
            high=95.0,
            meaning="share of frames that are lost: the landing system is not called",
            source="rpicam-apps issue 157: 7 % lost; librealsense issue 14928: 32 % lost",
        ),
        Parameter(
            name="stamp_error_ms",
            nominal=0.0,
            low=-500.0,
            high=500.0,
            meaning="how much later than the picture the pose is that comes with it, and the stamp",
            source="ArduPilot pull request 7046: the attitude of another moment, 50 to 200 ms off, "
            "is used for a picture; half of that",
        ),
    ),
)
