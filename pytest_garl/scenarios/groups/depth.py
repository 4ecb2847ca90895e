"""Depth: how far the depth camera reaches, and holes where it measures nothing."""

from __future__ import annotations

from pytest_garl.scenarios.groups.parameter import Group, Parameter

NO_LIMIT_M = 100.0
GROUP = Group(
    name="depth",
    meaning="a depth camera with a limited reach, and with holes",
    feeds="depth_m",
    parameters=(
        Parameter(
            name="range_m",
            nominal=NO_LIMIT_M,
            low=1.0,
            high=NO_LIMIT_M,
            meaning="reach of the depth camera in clear air, less in fog, rain and snow; beyond it "
            "the depth is 0; 100: no limit in any weather",
            source="Intel RealSense D400 series data sheet: about 10 m, which varies with light "
            "and calibration; the lidar equation for the air",
        ),
        Parameter(
            name="holes_percent",
            nominal=0.0,
            low=0.0,
            high=90.0,
            meaning="mean share of the picture in which nothing is measured, in patches that "
            "change within about half a second; the depth there is 0",
            source="librealsense issues 10769: depth of grassy and stony ground is patchy; 10229: "
            "holes on reflecting ground; 11286: a depth of 0 without a measurement; the end of the "
            "range is an engineering estimate",
        ),
    ),
)
